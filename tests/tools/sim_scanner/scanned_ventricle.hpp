#pragma once
// Cines of a ventricle in the simulated scanner, of a hundred pixels of 1 mm: four short-axis slices and three long-axis ones.

#include <filesystem>

#include "estimator/mesh/ellipsoid.hpp"
#include "tools/sim_scanner/scanner.hpp"

namespace diastole::scanner {

struct ScannedVentricle {
  ScannedVentricle() : mesh(make_ellipsoid(shape)) {
    protocol.short_axis_mm = {-36, -24, -12, 0};
    protocol.long_axis_deg = {0, 60, 120};
    protocol.middle_mm = -22.5;
    protocol.field_of_view_mm = 100;
    protocol.matrix = 100;
    protocol.tagged = false;
    protocol.cine = protocol.dark_bath = true;
  }
  /// It widens by 3 % from phase to phase: without motion an export is none.
  void scan_phases(int phases, const std::filesystem::path& folder, double step_s = 0.1) const {
    MovingBody body{&mesh, {}, {}, 1.0};
    for (int k = 0; k < phases; ++k) {
      body.times_s.push_back(0.01 + step_s * k);
      NodeField position_mm = mesh.reference();
      for (size_t node = 0; node < mesh.node_count(); ++node)
        for (size_t derivative = 0; derivative < 8; ++derivative)
          for (size_t axis = 0; axis < 2; ++axis)
            position_mm[dof_of(node, derivative, axis)] *= 1 + 0.03 * k;
      body.position_mm.push_back(position_mm);
    }
    std::filesystem::create_directories(folder);
    (void)scan(body, protocol, {}, folder, {});
  }

  EllipsoidShape shape;
  HermiteMesh mesh;
  ScanProtocol protocol;
};

}  // namespace diastole::scanner
