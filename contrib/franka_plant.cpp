// A Franka arm (libfranka) at mmt's plant link (docs/plugs.md#franka): the flange is the tool, under impedance control in torque mode.
//
//     c++ -std=c++17 -O2 -o franka_plant contrib/franka_plant.cpp -lfranka
//     ./franka_plant ROBOT - X Y [SECONDS]      # asks for the address that mmt printed: udp://127.0.0.1:PORT?token=…
//
// (X, Y), m in the robot's base frame, is the origin of mmt's world: put it where the slave's [environment] has the object. Height and
// orientation stay as they are at the start. Limits: 0.25 m from the start along x and y, the force that the slave allows, libfranka's own
// limiter of torque rates, and the robot's reflexes at 20 N and 20 Nm. Keep the stop button in your hand.

#include <franka/exception.h>
#include <franka/model.h>
#include <franka/robot.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>

#include "plug.hpp"

namespace {

using Vector = std::array<double, 3>;

volatile std::sig_atomic_t ended = 0;

// m: no command leads further from the start.
constexpr double room_m = 0.25;
// ns: without a command for so long the tool stands.
constexpr std::uint64_t silence_ns = 20'000'000;
// kg: what a hand at the flange feels of the arm; critical damping is made of it.
constexpr double arm_kg = 4.0;
// N/m, Nm/rad: what holds height and orientation; Nm s/rad: what keeps the elbow from drifting.
constexpr double stiff_up = 2000.0, stiff_turn = 40.0, still_joint = 1.0;

// N/m, N: what holds the tool in the plane before the first command.
constexpr double first_stiffness = 500.0, first_force_max = 15.0;

double critical(double stiffness, double inertia) { return 2.0 * std::sqrt(stiffness * inertia); }

// A column of a homogeneous transformation.
Vector column(const std::array<double, 16> &pose, std::size_t n) { return {pose[4 * n], pose[4 * n + 1], pose[4 * n + 2]}; }

Vector cross(const Vector &a, const Vector &b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

// The turn (rad, small) that leads from `pose` to the orientation of `wanted`: half the sum of the axes' cross products.
Vector turn(const std::array<double, 16> &pose, const std::array<double, 16> &wanted) {
  Vector sum{};
  for (std::size_t n = 0; n < 3; ++n) {
    const Vector part = cross(column(pose, n), column(wanted, n));
    for (std::size_t axis = 0; axis < 3; ++axis) sum[axis] += 0.5 * part[axis];
  }
  return sum;
}

}  // namespace

int main(int count, char **words) {
  if (count < 5) {
    std::fprintf(stderr, "usage: franka_plant ROBOT ADDRESS X Y [SECONDS]\n");
    return 2;
  }
  std::signal(SIGINT, [](int) { ended = 1; });
  const std::array<double, 2> origin{std::atof(words[3]), std::atof(words[4])};
  const double seconds = count > 5 ? std::atof(words[5]) : 1e9;
  auto plug = mmt::plugged_in<mmt::PlantPlug>(words[2]);
  try {
    franka::Robot robot(words[1]);
    robot.setCollisionBehavior({{20, 20, 20, 20, 20, 20, 20}}, {{20, 20, 20, 20, 20, 20, 20}}, {{20, 20, 20, 20, 20, 20}},
                               {{20, 20, 20, 20, 20, 20}});
    const franka::Model model = robot.loadModel();
    const auto start = robot.readOnce().O_T_EE;
    std::array<double, 2> goal{start[12], start[13]}, goal_speed{};
    double stiffness = first_stiffness, damping = critical(first_stiffness, arm_kg), force_max = first_force_max;
    double peak_n = 0.0, way_m = 0.0;
    std::uint64_t last_command = 0;
    bool stands = false;
    const auto begin = mmt::now_ns();
    const auto period = [&](const franka::RobotState &state, franka::Duration) -> franka::Torques {
      const auto now = mmt::now_ns();
      const Vector at = column(state.O_T_EE, 3);
      if (const auto taken = plug.receive(0); taken && taken->periods > 0) {
        last_command = now;
        stands = false;
        for (std::size_t axis = 0; axis < 2; ++axis) {
          goal[axis] = std::clamp(origin[axis] + taken->numbers[axis], start[12 + axis] - room_m, start[12 + axis] + room_m);
          goal_speed[axis] = taken->numbers[2 + axis];
        }
        stiffness = std::clamp(taken->numbers[4], 0.0, 2000.0);
        damping = std::max(taken->numbers[5], critical(stiffness, arm_kg));
        force_max = taken->numbers[6];
      } else if (!stands && now - last_command > silence_ns) {
        // nobody commands: the tool stands where it is, on the spring that it had
        goal = {at[0], at[1]};
        goal_speed = {};
        stands = true;
      }
      // six rows of seven columns, column by column
      const auto jacobian = model.zeroJacobian(franka::Frame::kEndEffector, state);
      std::array<double, 6> twist{}, wrench{};
      for (std::size_t joint = 0; joint < 7; ++joint)
        for (std::size_t row = 0; row < 6; ++row) twist[row] += jacobian[6 * joint + row] * state.dq[joint];
      for (std::size_t axis = 0; axis < 2; ++axis)
        wrench[axis] = stiffness * (goal[axis] - at[axis]) + damping * (goal_speed[axis] - twist[axis]);
      const double force = std::hypot(wrench[0], wrench[1]);
      for (std::size_t axis = 0; axis < 2 && force > force_max; ++axis) wrench[axis] *= force_max / force;
      wrench[2] = stiff_up * (start[14] - at[2]) - critical(stiff_up, arm_kg) * twist[2];
      const Vector error = turn(state.O_T_EE, start);
      for (std::size_t axis = 0; axis < 3; ++axis) wrench[3 + axis] = stiff_turn * error[axis] - critical(stiff_turn, 0.1) * twist[3 + axis];
      // the robot adds gravity by itself
      std::array<double, 7> torques = model.coriolis(state);
      for (std::size_t joint = 0; joint < 7; ++joint) {
        torques[joint] -= still_joint * state.dq[joint];
        for (std::size_t row = 0; row < 6; ++row) torques[joint] += jacobian[6 * joint + row] * wrench[row];
      }
      // of the estimated wrench what the robot does to its environment is positive, as f_s is
      const std::array<double, 2> felt{state.O_F_ext_hat_K[0], state.O_F_ext_hat_K[1]};
      plug.send(0, {at[0] - origin[0], at[1] - origin[1], twist[0], twist[1], felt[0], felt[1], 0.0, 0.0, 0.0, 0.0});
      peak_n = std::max(peak_n, std::hypot(felt[0], felt[1]));
      way_m = std::max(way_m, std::hypot(at[0] - start[12], at[1] - start[13]));
      franka::Torques answer(torques);
      return ended != 0 || static_cast<double>(now - begin) > seconds * 1e9 ? franka::MotionFinished(answer) : answer;
    };
    // its limiter of torque rates is off unless it is asked for
    constexpr bool limits_rate = true;
    robot.control(period, limits_rate);
    std::printf("{\"sent\": %u, \"way_m\": %.4f, \"force_peak_n\": %.2f}\n", plug.sent(), way_m, peak_n);
  } catch (const franka::Exception &error) {
    // the plug is silent from here on: mmt stops the tool and takes the force from the hand
    std::fprintf(stderr, "the robot stopped: %s\n", error.what());
    return 1;
  }
}
