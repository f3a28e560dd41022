#include "tools/sim_scanner/ventricle_phantom.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <optional>
#include <random>

namespace diastole::scanner {
namespace {

using Eigen::Vector3d;
constexpr double half_turn = std::numbers::pi;

/// Where a function that rises through zero between two places is zero.
template <class Function>
std::optional<double> crossing(const Function& function, double low, double high) {
  const double at_low = function(low);
  if (at_low * function(high) > 0) return {};
  for (int i = 0; i < 50; ++i) {
    const double middle = 0.5 * (low + high);
    (function(middle) * at_low > 0 ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

}  // namespace

VentriclePhantom VentriclePhantom::random(std::uint64_t seed) {
  std::mt19937_64 engine(seed);
  const auto between = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(engine);
  };
  VentriclePhantom p;
  p.inner_across_mm = between(15, 30);
  p.inner_along_mm = p.inner_across_mm * between(1.8, 2.6);
  p.wall_across_mm = between(6, 13);
  p.wall_along_mm = p.wall_across_mm * between(0.6, 1);
  p.base_mm = p.inner_along_mm * between(0.1, 0.4);
  p.base_fall_mm = between(0, 0.15) * p.inner_along_mm;
  p.base_tilt = {between(-0.1, 0.1), between(-0.1, 0.1)};
  for (Eigen::Vector2d& wave : p.waves)
    wave = {between(-0.04, 0.04), between(-0.04, 0.04)};
  p.shortening = between(0, 0.3);
  const Eigen::Quaterniond turn(
      Eigen::Vector4d{between(-1, 1), between(-1, 1), between(-1, 1), between(-1, 1)});
  p.axes = turn.normalized().toRotationMatrix();
  p.origin_mm = {between(-40, 40), between(-40, 40), between(-40, 40)};
  return p;
}

Vector3d VentriclePhantom::own_place_mm(double t, double theta, double psi, double activity) const {
  // The outer wall moves by what a wall of constant volume leaves it, about a quarter.
  const double across = (inner_across_mm + t * wall_across_mm) * (1 - activity * shortening * (1 - 0.75 * t));
  double wave = 1;
  for (size_t i = 0; i < waves.size(); ++i) {
    const double n = static_cast<double>(i + 1);
    wave += (1 - 0.3 * t) * std::pow(std::sin(psi), n) *
            (waves[i].x() * std::cos(n * theta) + waves[i].y() * std::sin(n * theta));
  }
  const double radius = across * std::sin(psi) * wave;
  return {radius * std::cos(theta), radius * std::sin(theta),
          -(inner_along_mm + t * wall_along_mm) * std::cos(psi)};
}

double VentriclePhantom::above_base_mm(const Vector3d& own, double activity) const {
  return own.z() - (base_mm - activity * base_fall_mm) - base_tilt.dot(own.head<2>());
}

Vector3d VentriclePhantom::place_mm(double t, double theta, double psi, double activity) const {
  return origin_mm + axes * own_place_mm(t, theta, psi, activity);
}

double VentriclePhantom::base_psi(double t, double theta, double activity) const {
  return crossing([&](double psi) { return above_base_mm(own_place_mm(t, theta, psi, activity), activity); },
                  0.3, 2.9)
      .value();
}

double VentriclePhantom::cavity_mL(double activity) const {
  // A third of the surface's flux of the distance from a point on the base, whose plane has none.
  const Vector3d centre(0, 0, base_mm - activity * base_fall_mm);
  constexpr int around = 240, along = 240;
  double volume = 0;
  for (int i = 0; i < around; ++i) {
    const double theta = 2 * half_turn * i / around;
    const double end = base_psi(0, theta, activity);
    for (int j = 0; j < along; ++j) {
      const double psi = end * (j + 0.5) / along;
      constexpr double h = 1e-5;
      const Vector3d by_theta =
          (own_place_mm(0, theta + h, psi, activity) - own_place_mm(0, theta - h, psi, activity)) / (2 * h);
      const Vector3d by_psi =
          (own_place_mm(0, theta, psi + h, activity) - own_place_mm(0, theta, psi - h, activity)) / (2 * h);
      volume += (own_place_mm(0, theta, psi, activity) - centre).dot(by_psi.cross(by_theta)) *
                (2 * half_turn / around) * (end / along) / 3;
    }
  }
  return 1e-3 * std::abs(volume);
}

std::vector<Vector3d> VentriclePhantom::surface_mm(double t, double activity) const {
  std::vector<Vector3d> points;
  for (int i = 0; i < 36; ++i) {
    const double theta = 2 * half_turn * i / 36;
    const double end = base_psi(t, theta, activity);
    for (int j = 0; j < 16; ++j)
      points.push_back(place_mm(t, theta, end * (j + 0.5) / 16, activity));
  }
  return points;
}

/// Sets the clicks of one phantom, slice after slice.
struct Clicker {
  const VentriclePhantom& phantom;
  const ClickProtocol& protocol;
  std::mt19937_64 engine;
  Clicks clicks{};

  struct Slice {
    std::string name;
    Vector3d at, normal;  // in the phantom's axes
    Vector3d shift = Vector3d::Zero();
  };

  double uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(engine);
  }
  double normal() { return std::normal_distribution<double>()(engine); }
  /// A vector in the plane, of two normal components.
  Vector3d in_plane(const Slice& slice, double sigma_mm) {
    const Vector3d e = slice.normal.unitOrthogonal();
    const double across = normal(), along = normal();
    return sigma_mm * (along * e + across * slice.normal.cross(e));
  }

  void add(int phase, const Slice& slice, const char* surface, const Vector3d& own) {
    const Vector3d x =
        phantom.origin_mm + phantom.axes * (own + slice.shift + in_plane(slice, protocol.sigma_mm));
    // A zero sigma would be an equation.
    clicks.guide_csv += fmt::format("{},{},{},{:.4f},{:.4f},{:.4f},{:g}\n", phase, slice.name, surface, x.x(),
                                    x.y(), x.z(), std::max(protocol.sigma_mm, 1e-3));
  }

  void walls(int phase, const Slice& slice, bool is_long) {
    const double activity = clicks.activity[static_cast<size_t>(phase)];
    for (int wall = 0; wall < 2; ++wall) {
      const double t = wall;
      const auto off_plane = [&](double theta, double psi) {
        return slice.normal.dot(phantom.own_place_mm(t, theta, psi, activity) - slice.at);
      };
      const int count = is_long ? 14 : protocol.clicks;
      for (int i = 0; i < count; ++i) {
        std::optional<double> theta = 2 * half_turn * (i + uniform(0, 1)) / count, psi;
        if (is_long) {
          // Up and down both sides of the image's plane.
          const double beside =
              std::atan2(slice.normal.y(), slice.normal.x()) + (i % 2 ? half_turn / 2 : -half_turn / 2);
          psi = phantom.base_psi(t, beside, activity) * (i / 2 + uniform(0.1, 0.9)) / (count / 2);
          theta = crossing([&](double angle) { return off_plane(angle, *psi); }, beside - 1, beside + 1);
        } else {
          psi = crossing([&](double angle) { return off_plane(*theta, angle); }, 0.05, 2.9);
        }
        if (!theta || !psi) continue;
        const Vector3d own = phantom.own_place_mm(t, *theta, *psi, activity);
        if (phantom.above_base_mm(own, activity) < 0) add(phase, slice, wall == 0 ? "endo" : "epi", own);
      }
    }
  }

  void landmarks(int phase, const Slice& slice) {
    const double activity = clicks.activity[static_cast<size_t>(phase)];
    for (int wall = 0; wall < 2; ++wall) {
      for (const double side : {-half_turn / 2, half_turn / 2}) {
        const double theta = std::atan2(slice.normal.y(), slice.normal.x()) + side;
        if (protocol.base_points)
          add(phase, slice, "base",
              phantom.own_place_mm(wall, theta, phantom.base_psi(wall, theta, activity), activity));
      }
      add(phase, slice, wall == 0 ? "apex_endo" : "apex_epi", phantom.own_place_mm(wall, 0, 0, activity));
    }
  }

  void run() {
    clicks.guide_csv = "phase,slice,surface,x_mm,y_mm,z_mm,sigma_mm\n";
    for (int p = 0; p < protocol.phases; ++p)
      clicks.activity.push_back(0.5 - 0.5 * std::cos(2 * half_turn * p / protocol.phases));
    std::vector<Slice> slices;
    const Vector3d off_axis{uniform(-0.06, 0.06), uniform(-0.06, 0.06), 1};
    const double bottom = -phantom.inner_along_mm - phantom.wall_along_mm + 4;
    for (double z = bottom; z < phantom.base_mm; z += 8) {
      Slice slice{fmt::format("sa{:02}", slices.size()), Vector3d(0, 0, z), off_axis.normalized()};
      slice.shift = in_plane(slice, 1).normalized() * protocol.shift_mm;
      slices.push_back(slice);
    }
    for (int i = 0; i < 3; ++i)
      slices.push_back(
          {fmt::format("la{}", i), Vector3d(1, 1, 0),
           Vector3d(std::cos(half_turn * i / 3), std::sin(half_turn * i / 3), uniform(-0.05, 0.05))
               .normalized()});
    for (const Slice& slice : slices) {
      clicks.slices.push_back(slice.name);
      clicks.shifts_mm.push_back(phantom.axes * slice.shift);
    }
    for (int p = 0; p < protocol.phases; ++p) {
      for (const Slice& slice : slices) {
        const bool is_long = slice.name.starts_with("la");
        walls(p, slice, is_long);
        if (is_long) landmarks(p, slice);
      }
    }
  }
};

Clicks click(const VentriclePhantom& phantom, const ClickProtocol& protocol) {
  Clicker clicker{phantom, protocol, std::mt19937_64(protocol.seed)};
  clicker.run();
  return clicker.clicks;
}

}  // namespace diastole::scanner
