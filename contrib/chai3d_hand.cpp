// A haptic device that CHAI3D knows (Novint, Force Dimension, 3D Systems, …) at mmt's device link (docs/plugs.md#chai3d).
//
//     c++ -std=c++17 -O2 -I CHAI3D/src … -o chai3d_hand contrib/chai3d_hand.cpp -lchai3d …      # the flags of CHAI3D's own examples
//     ./chai3d_hand -      # asks for the address that mmt printed: udp://127.0.0.1:PORT?token=…
//
// CHAI3D's x points to the operator, y to the right, z up. In a horizontal plane that is, for --device-config:
//     axes = ["-x", "-y"]
// The first switch of the device holds the hand. Ctrl-C ends it; without an answer of mmt for 20 ms there is no force.

#include <csignal>
#include <cstdio>
#include <thread>

#include "chai3d.h"
#include "plug.hpp"

namespace {
volatile std::sig_atomic_t ended = 0;
}

int main(int count, char **words) {
  if (count < 2) {
    std::fprintf(stderr, "usage: chai3d_hand ADDRESS\n");
    return 2;
  }
  std::signal(SIGINT, [](int) { ended = 1; });
  auto plug = mmt::plugged_in<mmt::DevicePlug>(words[1]);
  chai3d::cHapticDeviceHandler handler;
  chai3d::cGenericHapticDevicePtr device;
  if (!handler.getDevice(device, 0) || !device->open() || !device->calibrate()) {
    std::fprintf(stderr, "CHAI3D finds no haptic device\n");
    return 1;
  }
  const auto info = device->getSpecifications();
  std::fprintf(stderr, "%s: at most %.1f N and %.0f N/m; set force_max_n and stiffness_n_per_m below that\n", info.m_modelName.c_str(),
               info.m_maxLinearForce, info.m_maxLinearStiffness);
  device->setEnableGripperUserSwitch(true);
  chai3d::cVector3d place, velocity, force(0.0, 0.0, 0.0);
  auto due = std::chrono::steady_clock::now(), last_answer = due;
  // a device that cannot be read gets no force, and mmt receives nothing of it any more
  while (ended == 0 && device->getPosition(place) && device->getLinearVelocity(velocity)) {
    bool is_down = false;
    device->getUserSwitch(0, is_down);
    const auto f = [](double number) { return static_cast<float>(number); };
    plug.send(is_down ? 1 : 0, {f(place.x()), f(place.y()), f(place.z()), f(velocity.x()), f(velocity.y()), f(velocity.z())});
    if (const auto taken = plug.receive(0); taken && taken->periods > 0) {
      force.set(taken->numbers[0], taken->numbers[1], taken->numbers[2]);
      last_answer = due;
    } else if (due - last_answer > std::chrono::milliseconds(20)) {
      force.zero();
    }
    device->setForce(force);
    due += std::chrono::milliseconds(1);
    // a host that stood still: skip, never catch up
    if (std::chrono::steady_clock::now() - due > std::chrono::milliseconds(10)) due = std::chrono::steady_clock::now();
    std::this_thread::sleep_until(due);
  }
  device->setForce(chai3d::cVector3d(0.0, 0.0, 0.0));
  device->close();
}
