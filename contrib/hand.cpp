// A scripted hand at mmt's device link in C++17 (docs/plugs.md), as contrib/hand.py: it grips, pushes along x, and lets go.
//
//     c++ -std=c++17 -O2 -o hand contrib/hand.cpp
//     ./hand - [WAY_M]      # asks for the address that mmt printed: udp://127.0.0.1:PORT?token=…
//
// Where `position` is simulated here, a driver reads its device; where `force` moves it, the driver commands its motors.

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <thread>

#include "plug.hpp"

int main(int count, char **words) {
  if (count < 2) {
    std::fprintf(stderr, "usage: hand ADDRESS [WAY_M]\n");
    return 2;
  }
  constexpr std::uint16_t session = 1, engaged = 2, in_contact = 4, stopped = 8;
  const double way = count > 2 ? std::atof(words[2]) : 0.35, speed = 0.1, period = 1e-3;
  const double mass = 0.5, stiffness = 400.0, damping = 25.0;
  auto plug = mmt::plugged_in<mmt::DevicePlug>(words[1]);
  double position = 0.0, velocity = 0.0, wanted = 0.0, peak = 0.0, contact_s = 0.0;
  std::array<float, 6> force{};
  std::uint16_t state = 0;
  int since_up = 0;
  auto due = std::chrono::steady_clock::now(), last_answer = due, begin = due;
  while (wanted < way && due - begin < std::chrono::seconds(30)) {
    if (const auto taken = plug.receive(0); taken && taken->periods > 0) {
      force = taken->numbers;
      state = taken->flags;
      last_answer = due;
    } else if (due - last_answer > std::chrono::milliseconds(20)) {
      // nobody answers: no force
      force = {};
      state = 0;
    }
    const bool held = (state & engaged) != 0;
    if (held) wanted += speed * period;
    contact_s += (state & in_contact) != 0 ? period : 0.0;
    peak = std::max(peak, std::hypot(static_cast<double>(force[0]), static_cast<double>(force[1])));
    velocity += period * (stiffness * (wanted - position) + damping * ((held ? speed : 0.0) - velocity) + force[0]) / mass;
    position += period * velocity;
    // the button is up for five packets and then down, until mmt has the hand
    since_up = held || (state & session) == 0 || (state & stopped) != 0 ? 0 : (since_up + 1) % 100;
    const bool down = held || since_up > 5;
    plug.send(down ? 1 : 0, {static_cast<float>(position), 0.0F, 0.0F, static_cast<float>(velocity), 0.0F, 0.0F});
    due += std::chrono::milliseconds(1);
    // a host that stood still: skip, never catch up
    if (std::chrono::steady_clock::now() - due > std::chrono::milliseconds(10)) due = std::chrono::steady_clock::now();
    std::this_thread::sleep_until(due);
  }
  plug.send(0, {static_cast<float>(position)});
  std::printf("{\"sent\": %u, \"lost_up\": %.0f, \"contact_s\": %.3f, \"force_peak_n\": %.3f, \"way_m\": %.3f}\n", plug.sent(),
              static_cast<double>(force[5]), contact_s, peak, wanted);
}
