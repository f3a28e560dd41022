// Clicks on simulated ventricles (tools/sim_scanner, which shares no shapes with the estimator) back to walls, volumes and slices.

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <tuple>

#include "estimator/imaging/geometry/slab_edges.hpp"
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

TEST(Ventricle, ItsApexIsFoundWhereTheOuterWallsFocusLiesBeyondIt) {
  VentriclePhantom truth;
  truth.inner_across_mm = 21;
  truth.inner_along_mm = 51;
  truth.wall_along_mm = 9;
  const VentricleFit fit = measured(click(truth, {.sigma_mm = 0, .clicks = 16}).guide_csv).fit;
  const WallMap map(fit.frame, fit.phases[0]);
  for (const bool is_inner : {true, false}) {
    const std::vector<Eigen::Vector3d> wall_mm = truth.surface_mm(is_inner ? 0 : 1, 0);
    const Eigen::Vector3d apex_mm = *std::ranges::min_element(
        wall_mm, {}, [&](const Eigen::Vector3d& x) { return fit.frame.inside(x).z(); });
    EXPECT_NEAR(map.distance_mm(is_inner ? -0.5 : 0.5, fit.frame.inside(apex_mm)), 0, 0.2) << is_inner;
  }
}

/// Exact clicks on ellipsoids (21, 51; 30, 60 mm, base at 15 mm) that widen from phase to phase, but for the base, which is held: six short-axis
/// and three long-axis slices.
std::string clicks_on_a_held_base(int phases) {
  std::string csv = "phase,slice,surface,x_mm,y_mm,z_mm,sigma_mm\n";
  const auto add = [&](int phase, const std::string& slice, const char* surface, double r, double angle,
                       double z) {
    csv += fmt::format("{},{},{},{},{},{},0.4\n", phase, slice, surface, r * std::cos(angle),
                       r * std::sin(angle), z);
  };
  constexpr double base_mm = 15, layer_mm = 6, pi = std::numbers::pi;
  for (int p = 0; p < phases; ++p) {
    for (const auto& [surface, across, along] : {std::tuple("endo", 21.0, 51.0), {"epi", 30.0, 60.0}}) {
      const auto radius = [p, across = across, along = along](double z) {
        return across * std::sqrt(1 - z * z / (along * along)) *
               (1 + 0.02 * p * -std::expm1((z - base_mm) / layer_mm));
      };
      for (int z = -40; z <= 10; z += 10)
        for (int i = 0; i < 16; ++i)
          add(p, fmt::format("sa{}", z / 10 + 4), surface, radius(z), pi * i / 8, z);
      for (int plane = 0; plane < 3; ++plane)
        for (const double turn : {0.0, pi})
          for (double z = -along + 1; z < base_mm - 2; z += 2.5)
            add(p, fmt::format("la{}", plane), surface, radius(z), pi * plane / 3 + turn, z);
    }
    for (int plane = 0; plane < 3; ++plane)
      for (const double turn : {0.0, pi})
        add(p, fmt::format("la{}", plane), "base", 25.5, pi * plane / 3 + turn, base_mm);
  }
  return csv;
}

TEST(Ventricle, AHeldBaseInLaterPhasesBendsNoWallInTheFirst) {
  const VentricleFit fit = measured(clicks_on_a_held_base(8)).fit;
  const WallMap map(fit.frame, fit.phases[0]);
  // Up to the base, beyond the last clicks.
  for (const double z : {-30.0, -10.0, 5.0, 10.0, 15.0})
    for (const auto& [side, across, along] : {std::tuple(-0.5, 21.0, 51.0), {0.5, 30.0, 60.0}})
      EXPECT_NEAR(
          map.distance_mm(side, fit.frame.inside({across * std::sqrt(1 - z * z / (along * along)), 0, z})), 0,
          0.1)
          << z << " mm, side " << side;
}

TEST(SlabEdges, AreMovedToTheWallInTheMiddleOfTheirSlice) {
  constexpr double thickness_mm = 8;
  GuidePoints guide = guide_points_from_text(clicks_on_a_held_base(1), "heart.guide.csv");
  std::vector<SlicePlane> planes(guide.slices.size());
  const auto is_long = [&](size_t slice) { return guide.slices[slice].starts_with("la"); };
  for (size_t s = 0; s < planes.size(); ++s) {
    const double angle = is_long(s) ? std::numbers::pi * (guide.slices[s].back() - '0') / 3 : 0.0;
    planes[s].along_row = {std::cos(angle), std::sin(angle), 0};
    planes[s].along_column = is_long(s) ? Eigen::Vector3d::UnitZ() : Eigen::Vector3d::UnitY();
    planes[s].thickness_mm = thickness_mm;
  }
  // Half of a round wall's section lies inside of where it is a quarter of the thickness beside the middle.
  const GuidePoints exact = guide;
  for (GuidePoint& point : guide.points) {
    const double r = point.place_mm.head<2>().norm();
    if (is_long(point.slice) && point.surface != GuideSurface::base && r > thickness_mm)
      point.place_mm.head<2>() *= std::sqrt(1 - std::pow(thickness_mm / (4 * r), 2));
  }
  const GuidePoints seen = guide;
  move_to_mid_slice(guide, fit_ventricle(guide), planes);
  double furthest_seen_mm = 0;
  for (size_t i = 0; i < guide.points.size(); ++i) {
    if (std::abs(exact.points[i].place_mm.z()) > 12) continue;
    furthest_seen_mm =
        std::max(furthest_seen_mm, (seen.points[i].place_mm - exact.points[i].place_mm).norm());
    EXPECT_LT((guide.points[i].place_mm - exact.points[i].place_mm).norm(), 0.02) << i;
  }
  EXPECT_GT(furthest_seen_mm, 0.09);
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

/// The table of these points, each changed.
std::string changed(const std::string& guide, const std::function<void(GuidePoints&)>& change) {
  GuidePoints points = guide_points_from_text(guide, "heart.guide.csv");
  change(points);
  return guide_file_text(points);
}

std::vector<std::string> ids_of(const VentricleFit& fit) {
  std::vector<std::string> ids;
  for (const Finding& finding : fit.findings)
    ids.push_back(finding.id);
  return ids;
}

TEST(Ventricle, DisplacedSlicesAreFoundInPointsThatScatterAcrossThem) {
  const Clicks clicks = click(bent(), {.phases = 4, .shift_mm = 3});
  std::mt19937_64 random(5);
  const auto scattered = [&](double sigma_mm) {
    std::normal_distribution<double> error(0, sigma_mm);
    return changed(clicks.guide_csv, [&](GuidePoints& guide) {
      for (GuidePoint& point : guide.points)
        point.place_mm += Eigen::Vector3d(error(random), error(random), error(random));
    });
  };
  const std::string whole = changed(clicks.guide_csv, [](GuidePoints& guide) {
    for (GuidePoint& point : guide.points)
      point.place_mm = point.place_mm.array().round();
  });
  for (const std::string& guide : {scattered(0.06), scattered(0.3), whole}) {
    const VentricleFit fit = measured(guide).fit;
    EXPECT_THAT(ids_of(fit), testing::IsEmpty());
    for (size_t s = 1; s < clicks.slices.size(); ++s) {
      if (clicks.slices[s].starts_with("la")) continue;
      EXPECT_FALSE(fit.shifts[s].is_reference) << clicks.slices[s];
      EXPECT_LT((fit.shifts[s].shift_mm - clicks.shifts_mm[s]).norm(), 1) << clicks.slices[s];
    }
  }
}

TEST(Ventricle, APointBesideItsImageHidesNoLongAxis) {
  const Clicks clicks = click(bent(), {.phases = 2, .shift_mm = 3});
  const VentricleFit fit = measured(changed(clicks.guide_csv, [](GuidePoints& guide) {
                             const std::vector<GuideSlice> slices = guide_slices(guide);
                             std::vector<bool> done(slices.size());
                             for (GuidePoint& point : guide.points) {
                               if (!guide.slices[point.slice].starts_with("la") || done[point.slice] ||
                                   point.surface != GuideSurface::endo)
                                 continue;
                               done[point.slice] = true;
                               point.place_mm += 3 * slices[point.slice].normal;
                             }
                           })).fit;
  EXPECT_THAT(ids_of(fit), testing::Not(testing::Contains("no-reference")));
}

TEST(Ventricle, SlicesThatMakeNoPlaneAreNamed) {
  const std::string guide =
      changed(click(bent(), {.phases = 2, .shift_mm = 3}).guide_csv, [](GuidePoints& g) {
        for (GuidePoint& point : g.points)
          if (g.slices[point.slice] == "la0") point.slice = 5;
      });
  const VentricleFit fit = measured(guide).fit;
  const auto found = std::find_if(fit.findings.begin(), fit.findings.end(),
                                  [](const Finding& finding) { return finding.id == "no-plane"; });
  ASSERT_NE(found, fit.findings.end());
  EXPECT_EQ(found->where, "slice sa05");
  VentricleRequest kept;
  kept.fit.estimate_shifts = false;
  EXPECT_THAT(ids_of(measured(guide, kept).fit), testing::Not(testing::Contains("no-plane")));
}

TEST(Ventricle, ASliceWithoutPointsIsNamedAndItsPlaceIsNotKnown) {
  GuidePoints guide =
      guide_points_from_text(click(VentriclePhantom(), {.shift_mm = 3}).guide_csv, "heart.guide.csv");
  guide.slices.emplace_back("sa99");
  const VentricleSession session = measure_ventricle({}, std::move(guide));
  const SliceShift& unseen = session.fit.shifts.back();
  EXPECT_EQ(unseen.slice, "sa99");
  EXPECT_FALSE(unseen.is_reference);
  EXPECT_EQ(unseen.sigma_mm, session.fit.shift_spread_mm);
  EXPECT_GT(unseen.sigma_mm, 1.0);
  EXPECT_THAT(session.fit.findings, testing::Contains(AllOf(testing::Field(&Finding::id, "no-points"),
                                                            testing::Field(&Finding::where, "slice sa99"))));
}

TEST(Ventricle, AHeartSmallerThanARatsIsAskedForItsUnit) {
  for (const double unit_mm : {10.0, 1000.0}) {
    const VentricleFit fit =
        measured(changed(click(VentriclePhantom{}, {}).guide_csv, [&](GuidePoints& guide) {
          for (GuidePoint& point : guide.points)
            point.place_mm /= unit_mm;
        })).fit;
    EXPECT_THAT(ids_of(fit), testing::Contains("unit")) << unit_mm;
  }
}

TEST(Ventricle, GrosslyWrongPointsAreLeftOutAndNamed) {
  const VentriclePhantom truth = bent();
  const std::string good = click(truth, {}).guide_csv;
  const auto fitted = [&](const std::function<void(GuidePoints&)>& change) {
    return measured(changed(good, change)).fit;
  };
  for (const double far_mm : {60.0, 200.0, 1000.0}) {
    const VentricleFit fit = fitted([&](GuidePoints& guide) {
      guide.points[100].place_mm += far_mm * guide.points[100].place_mm.normalized();
    });
    EXPECT_THAT(ids_of(fit), testing::ElementsAre("wild-point")) << far_mm;
    EXPECT_LT(wall_rms_mm(fit, 0, truth, 0), 0.35) << far_mm;
  }
  // A point of the base whose decimal point was lost.
  EXPECT_THAT(ids_of(fitted([](GuidePoints& guide) {
                const auto base =
                    std::find_if(guide.points.begin(), guide.points.end(),
                                 [](const GuidePoint& point) { return point.surface == GuideSurface::base; });
                base->place_mm *= 10;
              })),
              testing::ElementsAre("wild-point"));
  const VentricleFit fit = fitted([](GuidePoints& guide) {
    for (size_t i = 0; i < guide.points.size(); i += 25)
      guide.points[i].place_mm *= 10;
  });
  EXPECT_LT(wall_rms_mm(fit, 0, truth, 0), 0.4);
}

TEST(Ventricle, ErrorsLargerThanStatedAreTold) {
  const VentricleFit fit = measured(changed(click(bent(), {.phases = 2}).guide_csv, [](GuidePoints& guide) {
                             for (GuidePoint& point : guide.points)
                               point.sigma_mm = 0.2;
                           })).fit;
  const auto found = std::find_if(fit.findings.begin(), fit.findings.end(),
                                  [](const Finding& finding) { return finding.id == "noise"; });
  ASSERT_NE(found, fit.findings.end());
  EXPECT_NEAR(found->number, 2.5, 0.4);
}

TEST(GuidePoints, ATableMayHaveItsColumnsInAnyOrderAndNoSigma) {
  const std::string rows = "0.5,-1,2,ENDO,sa00,3\n4,5,6,Apex_Epi,la0,7\n";
  const GuidePoints guide =
      guide_points_from_text("\xEF\xBB\xBFx_mm,y_mm,z_mm,surface,slice,phase\r\n" + rows, "g.csv", 0.7);
  ASSERT_EQ(guide.points.size(), 2U);
  EXPECT_EQ(guide.points[0].place_mm, Eigen::Vector3d(0.5, -1, 2));
  EXPECT_EQ(guide.points[0].sigma_mm, 0.7);
  EXPECT_EQ(guide.points[1].surface, GuideSurface::apex_epi);
  EXPECT_EQ(guide.phases, (std::vector<int>{3, 7}));
  ASSERT_EQ(guide.findings.size(), 1U);
  EXPECT_EQ(guide.findings[0].id, "default-sigma");
  for (const char* header : {"x_mm,y_mm,z_mm,surface,slice,x_mm\n", "x_mm,y_mm,surface,slice,phase\n",
                             "x_mm,y_mm,z_mm,surface,slice,phase,weight\n"})
    EXPECT_THAT(test::message_of([&] { (void)guide_points_from_text(header + rows, "g.csv"); }),
                HasSubstr("header"));
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
