// Clicks on simulated ventricles (tools/sim_scanner, which shares no shapes with the estimator) back to walls, volumes and slices.

#include <gmock/gmock.h>

#include <cmath>
#include <numbers>

#include "estimator/imaging/geometry/ventricle_session.hpp"
#include "estimator/imaging/geometry/wall_harmonics.hpp"
#include "estimator/imaging/geometry/wall_map.hpp"
#include "estimator/mesh/ellipsoid.hpp"
#include "tests/estimator/io/scratch_file.hpp"
#include "tools/sim_scanner/ventricle_phantom.hpp"

namespace diastole::imaging {
namespace {

using scanner::click;
using scanner::Clicks;
using scanner::VentriclePhantom;
using testing::AllOf;
using testing::HasSubstr;

VentricleSession measured(const std::string& guide, const VentricleRequest& request = {}) {
  return measure_ventricle(request, guide_points_from_text(guide, "heart.guide.csv"));
}

/// Of the size of the labelled hearts.
VentriclePhantom bent() {
  return {.waves = {Eigen::Vector2d(0.02, -0.01), Eigen::Vector2d(-0.03, 0.02), Eigen::Vector2d(0.01, 0.01)}};
}

/// RMS distance of the true wall's points from the fitted wall.
double wall_rms_mm(const VentricleFit& fit, size_t phase, const VentriclePhantom& truth, double activity) {
  const WallMap map(fit.frame, fit.phases[phase]);
  double squares = 0, count = 0;
  for (const double t : {0.0, 1.0})
    for (const Eigen::Vector3d& x : truth.surface_mm(t, activity)) {
      squares += std::pow(map.distance_mm(t - 0.5, fit.frame.inside(x)), 2);
      count += 1;
    }
  return std::sqrt(squares / count);
}

TEST(WallHarmonics, AreOrthonormalAndTheirSlopesAreRight) {
  constexpr int degree = 5;
  const Eigen::Index n = harmonic_count(degree);
  Eigen::MatrixXd products = Eigen::MatrixXd::Zero(n, n);
  constexpr int steps = 200;
  for (int i = 0; i < steps; ++i)
    for (int j = 0; j < 2 * degree + 2; ++j) {
      const double mu = std::numbers::pi * (i + 0.5) / steps;
      const double theta = 2 * std::numbers::pi * j / (2 * degree + 2);
      const Harmonics h = harmonics(degree, mu, theta);
      products += h.value * h.value.transpose() * std::sin(mu) * (std::numbers::pi / steps) *
                  (2 * std::numbers::pi / (2 * degree + 2));
    }
  EXPECT_LT((products - Eigen::MatrixXd::Identity(n, n)).cwiseAbs().maxCoeff(), 1e-3);
  constexpr double step = 1e-6;
  for (const double mu : {-0.4, 0.0, 0.7, 2.0}) {
    const Harmonics at = harmonics(degree, mu, 0.9);
    EXPECT_LT((harmonics(degree, mu + step, 0.9).value - harmonics(degree, mu - step, 0.9).value -
               2 * step * at.by_mu)
                  .norm(),
              1e-10);
    EXPECT_LT((harmonics(degree, mu, 0.9 + step).value - harmonics(degree, mu, 0.9 - step).value -
               2 * step * at.by_theta)
                  .norm(),
              1e-10);
  }
}

TEST(Ventricle, ClicksWithoutErrorGiveTheWallsBack) {
  const VentriclePhantom truth;
  const VentricleSession session = measured(click(truth, {.sigma_mm = 0, .clicks = 16}).guide_csv);
  // A tenth of what a click errs by.
  EXPECT_LT(wall_rms_mm(session.fit, 0, truth, 0), 0.05);
  EXPECT_NEAR(session.phases[0].mesh.cavity_mL, truth.cavity_mL(0), 2e-3 * truth.cavity_mL(0));
  EXPECT_LT(session.phases[0].mesh_error_mm, 0.05);
  EXPECT_GT(session.phases[0].mesh.least_jacobian, 0.5);
}

TEST(Ventricle, IsMeasuredInEveryPhaseFromClicksOfHalfAMillimetre) {
  const VentriclePhantom truth = bent();
  const Clicks clicks = click(truth, {.phases = 10});
  const VentricleSession session = measured(clicks.guide_csv);
  double chi_square = 0;
  for (size_t p = 0; p < session.phases.size(); ++p) {
    const double volume = truth.cavity_mL(clicks.activity[p]);
    EXPECT_LT(wall_rms_mm(session.fit, p, truth, clicks.activity[p]), 0.25) << p;
    EXPECT_NEAR(session.phases[p].mesh.cavity_mL, volume, 0.02 * volume) << p;
    chi_square +=
        std::pow((session.phases[p].mesh.cavity_mL - volume) / session.phases[p].cavity_sigma_mL, 2);
  }
  // Ten phases: the chance of more is one in a thousand, of less one in a thousand.
  EXPECT_LT(chi_square, 29.6);
  EXPECT_GT(chi_square, 1.5);
  EXPECT_NEAR(session.fit.noise_factor, 1, 0.15);
  // No slice was displaced, and none is said to be.
  EXPECT_LT(session.fit.shift_spread_mm, 0.15);
  const double ejection = 1 - truth.cavity_mL(1) / truth.cavity_mL(0);
  EXPECT_NEAR(session.ejection_fraction(), ejection, 0.02);
}

TEST(Ventricle, DisplacedSlicesAreFoundAndPutBack) {
  const VentriclePhantom truth = bent();
  const Clicks clicks = click(truth, {.phases = 16, .shift_mm = 3});
  const VentricleSession session = measured(clicks.guide_csv);
  for (size_t s = 0; s < clicks.slices.size(); ++s) {
    const SliceShift& found = session.fit.shifts[s];
    ASSERT_EQ(found.slice, clicks.slices[s]);
    EXPECT_EQ(found.is_reference, found.slice.starts_with("la"));
    if (found.is_reference) continue;
    // The slices at the ends have little else to hold them.
    const bool is_end = s == 0 || clicks.slices[s + 1].starts_with("la");
    EXPECT_LT((found.shift_mm - clicks.shifts_mm[s]).norm(), is_end ? 0.6 : 0.3) << found.slice;
  }
  EXPECT_LT(wall_rms_mm(session.fit, 0, truth, 0), 0.25);
  VentricleRequest request;
  request.fit.estimate_shifts = false;
  EXPECT_GT(wall_rms_mm(measured(clicks.guide_csv, request).fit, 0, truth, 0), 0.5);
}

TEST(Ventricle, AnEllipsoidsMeshIsThatOfTheStudies) {
  VentriclePhantom truth;
  truth.base_tilt.setZero();
  VentricleRequest request;
  request.mesh.elements = {8, 4, 2};
  const VentricleSession session = measured(click(truth, {.sigma_mm = 0, .clicks = 16}).guide_csv, request);
  const HermiteMesh ellipsoid = make_ellipsoid(
      {.inner_axes_mm = {22, 54}, .outer_axes_mm = {31, 62}, .base_z_mm = 15, .elements = {8, 4, 2}});
  EXPECT_NEAR(session.phases[0].mesh.wall_mL, measure_mesh(ellipsoid).wall_mL, 0.2);
  EXPECT_EQ(session.body.mesh.ties().same, ellipsoid.ties().same);
  EXPECT_EQ(session.body.mesh.faces().top.size(), ellipsoid.faces().top.size());
  // What is written comes back to the last bit, and is no folded mesh to its reader.
  const MeshBody again = mesh_from_text(mesh_file_text(session.body), "heart.mesh");
  EXPECT_EQ(again.mesh.reference(), session.body.mesh.reference());
}

TEST(Ventricle, IsAsGoodFromAGPFile) {
  const VentriclePhantom truth;
  const GuidePoints guide = guide_points_from_text(click(truth, {}).guide_csv, "g.csv");
  std::string gpfile = "x\ty\tz\tcontour type\tsliceID\tweight\ttime frame\n";
  for (const GuidePoint& point : guide.points) {
    const bool is_short = guide.slices[point.slice].starts_with("sa");
    const char* type = point.surface == GuideSurface::base        ? "MITRAL_VALVE"
                       : point.surface == GuideSurface::apex_epi  ? "APEX_POINT"
                       : point.surface == GuideSurface::apex_endo ? "APEX_ENDO_POINT"
                       : point.surface == GuideSurface::endo
                           ? (is_short ? "SAX_LV_ENDOCARDIAL" : "LAX_LV_ENDOCARDIAL")
                           : (is_short ? "SAX_RV_SEPTUM" : "LAX_LV_EPICARDIAL");
    gpfile += std::to_string(point.place_mm.x()) + "\t" + std::to_string(point.place_mm.y()) + "\t" +
              std::to_string(point.place_mm.z()) + "\t" + type + "\t" + std::to_string(point.slice) +
              "\t1.0\t0\n";
  }
  gpfile += "1 2 3 SAX_RV_FREEWALL 4 1 0\n";
  const VentricleSession session = measured(gpfile);
  EXPECT_LT(wall_rms_mm(session.fit, 0, truth, 0), 0.3);
  ASSERT_EQ(session.fit.findings.size(), 1U);
  EXPECT_THAT(session.fit.findings[0].what, HasSubstr("SAX_RV_FREEWALL"));
}

TEST(Ventricle, AWildClickIsNamedAndHardlyPulls) {
  const VentriclePhantom truth;
  std::string guide = click(truth, {}).guide_csv;
  const Eigen::Vector3d place = truth.place_mm(0, 1, 1.4, 0) + truth.axes * Eigen::Vector3d(6, 9, 0);
  guide += "0,sa04,endo," + std::to_string(place.x()) + "," + std::to_string(place.y()) + "," +
           std::to_string(place.z()) + ",0.5\n";
  const VentricleSession session = measured(guide);
  EXPECT_LT(wall_rms_mm(session.fit, 0, truth, 0), 0.35);
  EXPECT_THAT(session.fit.findings, testing::Contains(testing::Field(&Finding::id, "wild-point")));
}

TEST(Ventricle, WithoutPointsOfTheBaseEndsAtTheTopSlice) {
  const VentricleSession session = measured(click(VentriclePhantom{}, {.base_points = false}).guide_csv);
  EXPECT_THAT(session.fit.findings, testing::Contains(testing::Field(&Finding::id, "no-base")));
  EXPECT_LT(session.phases[0].mesh.cavity_mL, VentriclePhantom{}.cavity_mL(0));
}

TEST(Ventricle, WhatMakesNoneIsRefusedWithAReason) {
  const std::string header = "phase,slice,surface,x_mm,y_mm,z_mm,sigma_mm\n";
  const auto refusal = [&](const std::string& guide, const VentricleRequest& request = {}) {
    return test::message_of([&] { (void)measured(guide, request); });
  };
  EXPECT_THAT(refusal("x,y\n1,2\n"), AllOf(HasSubstr("heart.guide.csv: line 1"), HasSubstr("header")));
  EXPECT_THAT(refusal(header), HasSubstr("no guide points"));
  EXPECT_THAT(refusal(header + "0,sa00,endo,1,2,3\n"), AllOf(HasSubstr("line 2"), HasSubstr("6 columns")));
  EXPECT_THAT(refusal(header + "0,sa00,middle,1,2,3,0.5\n"),
              AllOf(HasSubstr("line 2, column surface"), HasSubstr("\"middle\"")));
  EXPECT_THAT(refusal(header + "0,sa00,endo,1,nan,3,0.5\n"),
              AllOf(HasSubstr("column y_mm"), HasSubstr("\"nan\"")));
  EXPECT_THAT(refusal(header + "0,sa00,endo,1,2,3,0\n"),
              AllOf(HasSubstr("column sigma_mm"), HasSubstr("not above 0")));
  EXPECT_THAT(refusal(header + "0.5,sa00,endo,1,2,3,0.5\n"),
              AllOf(HasSubstr("column phase"), HasSubstr("whole number")));
  EXPECT_THAT(refusal("1 2 3 SAX_LV_ENDOCARDIAL 4 -1 0\n"),
              AllOf(HasSubstr("column weight"), HasSubstr("negative")));
  EXPECT_THAT(refusal(header + "0,sa00,endo,1,2,3,0.5\n"), HasSubstr("1 points of the endocardium"));
  const std::string good = click(VentriclePhantom{}, {}).guide_csv;
  VentricleRequest request;
  request.phase = 3;
  EXPECT_THAT(refusal(good, request), AllOf(HasSubstr("no phase 3"), HasSubstr("It has 0")));
  request = {};
  request.fit.reference_slices = {"sa99"};
  EXPECT_THAT(refusal(good, request), AllOf(HasSubstr("--reference"), HasSubstr("\"sa99\"")));
  // Both walls exchanged: the wall is inside out.
  std::string exchanged = good;
  for (size_t at = 0; (at = exchanged.find(",e", at)) != std::string::npos; at += 5)
    exchanged.replace(at, exchanged.compare(at, 5, ",endo") == 0 ? 5 : 4,
                      exchanged.compare(at, 5, ",endo") == 0 ? ",epi" : ",endo");
  EXPECT_THAT(refusal(exchanged), AllOf(HasSubstr("phase 0"), HasSubstr("folded")));
}

}  // namespace
}  // namespace diastole::imaging
