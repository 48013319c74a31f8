// A plant at mmt's plant link in C++17 (docs/plugs.md): a block on a table with friction, as contrib/plant.py.
//
//     c++ -std=c++17 -O2 -o plant contrib/plant.cpp
//     ./plant - [SECONDS]      # asks for the address that mmt printed: udp://127.0.0.1:PORT?token=…

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "plug.hpp"

namespace {

constexpr double period_s = 1e-3;

struct Block {
  double mass = 0.7, half = 0.18, damping = 3.0, coulomb = 0.3 * 0.7 * 9.81;
  std::array<double, 2> at{}, speed{}, force{}, tip{-0.45, 0.0}, tip_speed{};

  void step(const std::array<double, 10> &command) {
    const std::array<double, 2> tool{command[0], command[1]};
    const std::array<double, 2> tool_speed{command[2], command[3]};
    force = {};
    tip = tool;
    tip_speed = tool_speed;
    const std::array<double, 2> inside{half - std::abs(tool[0] - at[0]), half - std::abs(tool[1] - at[1])};
    if (std::min(inside[0], inside[1]) > 0.0) {
      const int axis = inside[0] <= inside[1] ? 0 : 1;
      const double side = std::copysign(1.0, at[axis] - tool[axis]);
      const double closing = (tool_speed[axis] - speed[axis]) * side;
      force[axis] = side * std::clamp(command[4] * inside[axis] + command[5] * closing, 0.0, command[6]);
      // a tip that gives stands at the surface
      tip[axis] -= side * inside[axis];
      tip_speed[axis] = speed[axis];
    }
    for (int axis = 0; axis < 2; ++axis) {
      const double next = speed[axis] + period_s * (force[axis] - damping * speed[axis]) / mass;
      speed[axis] = std::copysign(std::max(std::abs(next) - period_s * coulomb / mass, 0.0), next);
      at[axis] += period_s * speed[axis];
    }
  }
};

}  // namespace

int main(int count, char **words) {
  if (count < 2) {
    std::fprintf(stderr, "usage: plant ADDRESS [SECONDS]\n");
    return 2;
  }
  const double seconds = count > 2 ? std::atof(words[2]) : 1e9;
  auto plug = mmt::plugged_in<mmt::PlantPlug>(words[1]);
  Block block;
  unsigned long long period = 0;
  for (const auto begin = mmt::now_ns(); static_cast<double>(mmt::now_ns() - begin) < seconds * 1e9;) {
    // without a command an answer each 10 ms, that a session finds the tool where it is
    const auto command = plug.receive(10);
    const auto periods = command ? std::min(command->periods, 20U) : 0U;
    for (unsigned n = 0; n < periods; ++n, ++period) block.step(command->numbers);
    // 30 images a second
    const bool seen = !command || (periods > 0 && period % 33 == 0);
    plug.send(seen ? 1 : 0, {block.tip[0], block.tip[1], block.tip_speed[0], block.tip_speed[1], block.force[0], block.force[1],
                             block.at[0], block.at[1], 0.0, 0.0});
  }
}
