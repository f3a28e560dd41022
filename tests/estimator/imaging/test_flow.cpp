// Phase contrast of simulated Womersley flow (tools/sim_scanner, which shares no physics with the reader) back to flow, volume and loop.

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <cmath>
#include <filesystem>
#include <numbers>

#include "estimator/imaging/flow/flow_session.hpp"
#include "tests/estimator/imaging/finding_ids.hpp"
#include "tests/estimator/io/scratch_file.hpp"
#include "tools/sim_scanner/phase_contrast_scan.hpp"

namespace diastole::imaging {
namespace {

using scanner::FlowPhantom;
using scanner::PhaseContrastProtocol;
using test::ScratchFolder;
using testing::AllOf;
using testing::HasSubstr;

/// A small field of view: a tube of 12 mm, its wall and a ring of still gel.
PhaseContrastProtocol small() { return {.matrix = 64, .phases = 12}; }
FlowPhantom phantom() { return {.block_radius_mm = 18}; }

FlowMeasurement measured(const FlowPhantom& flow, const PhaseContrastProtocol& protocol,
                         const PhaseContrastRequest& scan = {}, const FlowRequest& request = {}) {
  const ScratchFolder scratch;
  scanner::scan_flow(flow, protocol, scratch.path());
  const ImageFolder folder = read_image_folder(scratch.path());
  require_sound(folder);
  return measure_flow(phase_contrast(folder, scan), request, scratch.path().string());
}

std::string refusal(const FlowPhantom& flow, const PhaseContrastProtocol& protocol,
                    const PhaseContrastRequest& scan = {}) {
  return test::message_of([&] { (void)measured(flow, protocol, scan); });
}

double peak_mL_s(const FlowPhantom& flow) {
  double peak = 0;
  for (int i = 0; i < 400; ++i)
    peak = std::max(peak, std::abs(flow.flow_mL_s(flow.period_s * i / 400)));
  return peak;
}

double stroke_mL(const FlowPhantom& flow) {
  double least = 0, most = 0;
  for (int i = 0; i < 4000; ++i) {
    const double volume = flow.volume_mL(flow.period_s * i / 4000);
    least = std::min(least, volume);
    most = std::max(most, volume);
  }
  return most - least;
}

/// Sum of squares of the phases' errors over their sigmas.
double chi_square(const FlowMeasurement& flow, const FlowPhantom& truth) {
  double sum = 0;
  for (const PhaseFlow& phase : flow.phases)
    sum += std::pow((phase.flow_mL_s.value - truth.flow_mL_s(phase.phase_s)) / phase.flow_mL_s.sigma, 2);
  return sum;
}

void expect_true(const FlowMeasurement& flow, const FlowPhantom& truth) {
  for (const PhaseFlow& phase : flow.phases)
    EXPECT_NEAR(phase.flow_mL_s.value, truth.flow_mL_s(phase.phase_s), 0.01 * peak_mL_s(truth))
        << phase.phase_s;
  EXPECT_NEAR(flow.stroke_mL.value, stroke_mL(truth), 0.01 * stroke_mL(truth));
  EXPECT_NEAR(flow.stroke_mL.value, stroke_mL(truth), 3 * flow.stroke_mL.sigma);
  // The chance of more is below one in ten thousand.
  EXPECT_LT(chi_square(flow, truth), 40);
}

TEST(Flow, IsMeasuredWithinAPercentAndItsErrorsAreTrue) {
  const FlowMeasurement flow = measured(phantom(), small());
  expect_true(flow, phantom());
  EXPECT_GT(chi_square(flow, phantom()), 2);
  EXPECT_NEAR(flow.lumen.scene.shape.radius_mm, 6, 0.03);
  EXPECT_NEAR(flow.lumen.reduced_chi_square, 1, 0.15);
  EXPECT_LT(std::abs(flow.closure_mL.value), 3 * flow.closure_mL.sigma);
  EXPECT_EQ(flow.unwrapped, 0U);
  EXPECT_FALSE(flow.lumen.moves);
  // A straight background was laid: 0.8 cm/s in the middle, less towards the tube.
  EXPECT_EQ(flow.background.order, 1);
  const double at_tube = 0.8 + 2.0 * 1.3 / 50 - 1.5 * -2.1 / 50;
  EXPECT_NEAR(flow.background.at_lumen_rad * flow.scan.cm_s_per_radian(), at_tube, 0.05);
  EXPECT_LT(flow.background.sigma_rad * flow.scan.cm_s_per_radian(), 0.1);
}

TEST(Flow, TurnsArePutBackAtAnSnrOf15) {
  PhaseContrastProtocol protocol = small();
  protocol.phases = 16;
  protocol.venc_cm_s = 48;  // the peak is 65
  protocol.snr = 15;
  const FlowMeasurement flow = measured(phantom(), protocol);
  EXPECT_GT(flow.unwrapped, 3U);
  expect_true(flow, phantom());
}

TEST(Flow, EachMakersValuesMeanTheSame) {
  for (const scanner::Maker maker : {scanner::Maker::philips, scanner::Maker::ge}) {
    PhaseContrastProtocol protocol = small();
    protocol.maker = maker;
    const FlowMeasurement flow = measured(phantom(), protocol);
    expect_true(flow, phantom());
    EXPECT_NEAR(flow.scan.venc_cm_s, 100, 0.2);
    EXPECT_THAT(flow.scan.venc_source,
                HasSubstr(maker == scanner::Maker::ge ? "noise in air" : "RescaleIntercept"));
  }
}

TEST(Flow, IsPositiveAlongTheNormalOfATiltedSlice) {
  PhaseContrastProtocol protocol = small();
  protocol.along_row = Eigen::Vector3d(0.8, 0.36, 0.48);
  protocol.along_column = Eigen::Vector3d(-0.6, 0.48, 0.64);
  protocol.tilt_deg = 20;
  const FlowMeasurement flow = measured(phantom(), protocol);
  expect_true(flow, phantom());
  EXPECT_NEAR(flow.lumen.area_mm2, 36 * std::numbers::pi / std::cos(20 * std::numbers::pi / 180), 0.01 * 120);
}

TEST(Flow, FollowsATubeThatShakes) {
  PhaseContrastProtocol protocol = small();
  protocol.wobble_mm = 0.6;
  const FlowMeasurement flow = measured(phantom(), protocol);
  EXPECT_TRUE(flow.lumen.moves);
  EXPECT_NEAR(flow.lumen.movement_mm, 0.36, 0.05);
  expect_true(flow, phantom());
}

TEST(Flow, FollowsATubeThatGoesFurtherThanItsEdgeIsWide) {
  PhaseContrastProtocol protocol = small();
  protocol.wobble_mm = 1.25;  // two pixels to either side
  const FlowMeasurement flow = measured(phantom(), protocol);
  EXPECT_TRUE(flow.lumen.moves);
  EXPECT_TRUE(flow.lumen.converged);
  EXPECT_NEAR(flow.lumen.reduced_chi_square, 1, 0.15);
  EXPECT_NEAR(flow.lumen.scene.shape.radius_mm, 6, 0.05);
  expect_true(flow, phantom());
}

TEST(Flow, IsMeasuredInTissueWithoutAWall) {
  FlowPhantom vessel = phantom();
  vessel.wall_mm = 0;
  PhaseContrastProtocol protocol = small();
  protocol.fluid_brightness = 1;
  protocol.inflow = 0;
  const FlowMeasurement flow = measured(vessel, protocol);
  EXPECT_NEAR(flow.lumen.scene.shape.wall_mm, 0, 0.1);
  EXPECT_NEAR(flow.lumen.reduced_chi_square, 1, 0.15);
  EXPECT_TRUE(flow.findings.empty());
  expect_true(flow, vessel);
}

TEST(Flow, IsMeasuredBesideAWallOfHalfTheSignal) {
  FlowPhantom vessel = phantom();
  vessel.wall_mm = 1;
  PhaseContrastProtocol protocol = small();
  protocol.wall_brightness = 0.5;
  const FlowMeasurement flow = measured(vessel, protocol);
  EXPECT_NEAR(flow.lumen.reduced_chi_square, 1, 0.15);
  EXPECT_TRUE(flow.findings.empty());
  expect_true(flow, vessel);
}

TEST(Flow, IsMeasuredInALongEllipse) {
  FlowPhantom tube = phantom();
  tube.block_radius_mm = 29;  // beyond the ellipse
  PhaseContrastProtocol protocol = small();
  protocol.matrix = 96;
  protocol.tilt_deg = 45;
  const FlowMeasurement flow = measured(tube, protocol);
  EXPECT_NEAR(flow.lumen.reduced_chi_square, 1, 0.15);
  expect_true(flow, tube);
}

TEST(Flow, ImagesThatTheFittedLumenDoesNotExplainAreAProblem) {
  const ScratchFolder scratch;
  scanner::scan_flow(phantom(), small(), scratch.path());
  PhaseContrast scan = phase_contrast(read_image_folder(scratch.path()), {});
  // A bright spot in the lumen, in all phases.
  for (Image& image : scan.magnitude)
    image.block(24, 30, 4, 4) *= 1.4F;
  const FlowMeasurement flow = measure_flow(scan, {}, scratch.path().string());
  ASSERT_GT(flow.lumen.reduced_chi_square, 2);
  ASSERT_EQ(flow.findings.size(), 1U);
  EXPECT_EQ(flow.findings[0].id, "lumen-misfit");
  EXPECT_THAT(flow.findings[0].what, HasSubstr("chi-square"));
  EXPECT_NEAR(flow.stroke_mL.value, stroke_mL(phantom()), 3 * flow.stroke_mL.sigma);
}

TEST(Flow, SpectraFilledUpWithZerosAndBalancedEncodingsAreFound) {
  PhaseContrastProtocol protocol = small();
  protocol.acquired = 0.75;
  protocol.is_balanced = true;
  protocol.venc_cm_s = 70;
  const FlowMeasurement flow = measured(phantom(), protocol);
  EXPECT_EQ(flow.lumen.encoding, Encoding::balanced);
  EXPECT_NEAR(flow.lumen.reduced_chi_square, 1, 0.25);
  expect_true(flow, phantom());
}

TEST(Flow, ALeakIsToldAndClosingIsAskedFor) {
  FlowPhantom leaking = phantom();
  leaking.steady_mL_s = 2.0;
  const FlowMeasurement open = measured(leaking, small());
  EXPECT_NEAR(open.closure_mL.value, 2.4, 3 * open.closure_mL.sigma);
  const FlowMeasurement shut = measured(leaking, small(), {}, {.close = true});
  EXPECT_NEAR(shut.closure_mL.value, open.closure_mL.value, 1e-9);
  EXPECT_NEAR(shut.volume_at(shut.interval_s()).value, shut.volume_at(0).value, 1e-6);
  EXPECT_NEAR(shut.stroke_mL.value, stroke_mL(phantom()), 0.01 * 20);
}

TEST(Flow, WhatCannotBeMeasuredIsRefusedWithTagAndRemedy) {
  PhaseContrastProtocol protocol = small();
  protocol.says_venc = false;
  EXPECT_THAT(refusal(phantom(), protocol), AllOf(HasSubstr("(0018,9197)"), HasSubstr("--venc")));
  const FlowMeasurement by_option = measured(phantom(), protocol, {.venc_cm_s = 100.0});
  EXPECT_EQ(by_option.scan.venc_source, "--venc");
  expect_true(by_option, phantom());

  protocol = small();
  protocol.has_magnitude = false;
  EXPECT_THAT(refusal(phantom(), protocol), AllOf(HasSubstr("no magnitude"), HasSubstr("Export")));

  {
    const ScratchFolder scratch;
    scanner::scan_flow(phantom(), small(), scratch.path());
    std::filesystem::remove(scratch.path() / "m07.dcm");
    EXPECT_THAT(test::message_of([&] { (void)phase_contrast(read_image_folder(scratch.path()), {}); }),
                AllOf(HasSubstr("series 4"), HasSubstr("650 ms"), HasSubstr("Export the magnitude series")));
  }

  protocol = small();
  protocol.missing_phase = 5;
  EXPECT_THAT(refusal(phantom(), protocol), AllOf(HasSubstr("phase 5"), HasSubstr("--bridge-gaps")));
  const FlowMeasurement bridged = measured(phantom(), protocol, {.bridge_gaps = true});
  EXPECT_EQ(bridged.phases.size(), 11U);
  EXPECT_NEAR(bridged.stroke_mL.value, stroke_mL(phantom()), 3 * bridged.stroke_mL.sigma);

  FlowPhantom still = phantom();
  still.stroke_mL = 0;
  EXPECT_THAT(refusal(still, small()), AllOf(HasSubstr("no lumen"), HasSubstr("--centre")));
}

TEST(Flow, WrapsBeyondRecoveryAreRefused) {
  FlowPhantom fast = phantom();
  fast.stroke_mL = 120;  // 390 cm/s
  PhaseContrastProtocol protocol = small();
  protocol.phases = 6;
  protocol.venc_cm_s = 60;
  EXPECT_THAT(refusal(fast, protocol),
              AllOf(HasSubstr("wraps beyond recovery"), HasSubstr("venc above the peak")));
}

TEST(Flow, WhatContradictsTheHeadersIsTakenAndTold) {
  const FlowMeasurement slip = measured(phantom(), small(), {.venc_cm_s = 50.0, .interval_s = 3.0});
  EXPECT_EQ(slip.scan.venc_cm_s, 50);
  EXPECT_THAT(test::ids_of(slip.findings),
              testing::IsSupersetOf({"venc-contradicted", "period-contradicted", "cycle-not-seen"}));
  const FlowMeasurement same = measured(phantom(), small(), {.venc_cm_s = 100.0, .interval_s = 1.2});
  EXPECT_THAT(same.findings, testing::IsEmpty());
}

TEST(PressureVolumeLoop, FlowOutOfTheSpecimenIsNotTakenForFlowIntoIt) {
  const ScratchFolder scratch;
  std::filesystem::create_directory(scratch.path() / "dicom");
  scanner::scan_flow(phantom(), small(), scratch.path() / "dicom");
  std::string pressure = "time_s,cavity_kPa\n";
  runfile::PumpTrace pump;
  for (int i = 0; i < 1500; ++i) {
    const double t = i / 300.0;
    pressure += fmt::format("{:.5f},{:.6f}\n", t, 0.1 * phantom().volume_mL(t));
    pump.time_s.push_back(t);
    pump.commanded_mL.push_back(1.3 * phantom().volume_mL(t));
  }
  FlowSessionRequest request;
  request.folder = scratch.path() / "dicom";
  request.pressure = scratch.write("p.csv", pressure);
  request.trigger = scratch.write("t.csv", "time_s\n0\n1.2\n2.4\n3.6\n");
  EXPECT_THAT(measure_session(request).findings, testing::IsEmpty());
  request.scan.reverse = true;
  const FlowSession reversed = measure_session(request);
  EXPECT_THAT(test::ids_of(reversed.findings), testing::ElementsAre("reversed", "pressure-falls"));
  // With the pump's record it is no doubt.
  runfile::RecordedRun run = run_of_tables(*request.pressure, *request.trigger);
  run.pump = pump;
  const auto loop_with = [&](const FlowMeasurement& flow) {
    return pressure_volume_loop(flow, {run, runfile::rows_of(run)}, {});
  };
  EXPECT_THAT(test::message_of([&] { (void)loop_with(reversed.flow); }),
              AllOf(HasSubstr("falls while the pump fills"), HasSubstr("--reverse")));
  request.scan.reverse = false;
  const FlowMeasurement right = measure_session(request).flow;
  EXPECT_THAT(loop_with(right).findings, testing::IsEmpty());
  for (double& volume_mL : run.pump.commanded_mL)
    volume_mL *= 0.5;
  EXPECT_THAT(test::ids_of(loop_with(right).findings), testing::ElementsAre("more-than-pumped"));
}

TEST(PressureVolumeLoop, ItsAreaIsTheWork) {
  const ScratchFolder scratch;
  std::filesystem::create_directory(scratch.path() / "dicom");
  scanner::scan_flow(phantom(), small(), scratch.path() / "dicom");
  // p = 0.1 V + 0.004 Q: the second term encloses an area, the first none.
  std::string pressure = "time_s,cavity_kPa\n", trigger = "time_s\n";
  for (int i = 0; i < 1500; ++i) {
    const double t = i / 300.0;
    pressure +=
        fmt::format("{:.5f},{:.6f}\n", t, 0.1 * phantom().volume_mL(t) + 0.004 * phantom().flow_mL_s(t));
  }
  for (int i = 0; i < 4; ++i)
    trigger += fmt::format("{:.5f}\n", 1.2 * i);
  FlowSessionRequest request;
  request.folder = scratch.path() / "dicom";
  request.pressure = scratch.write("p.csv", pressure);
  request.trigger = scratch.write("t.csv", trigger);
  const FlowSession session = measure_session(request);
  double work_mJ = 0;
  for (int i = 0; i < 2000; ++i)
    work_mJ += 1.2 / 2000 * 0.004 * std::pow(phantom().flow_mL_s(1.2 * i / 2000), 2);
  ASSERT_TRUE(session.loop);
  EXPECT_NEAR(session.loop->work_mJ.value, work_mJ, 0.02 * work_mJ);
  EXPECT_NEAR(session.loop->work_mJ.value, work_mJ, 4 * session.loop->work_mJ.sigma);
  size_t known = 0;
  for (const LoopPoint& point : session.loop->points) {
    if (!point.stiffness_kPa_per_mL || point.phase_s < 0.1 || point.phase_s > 0.28) continue;
    // On the constant acceleration dQ/dt = 16 S / T^2 adds to dp/dV.
    const double expected = 0.1 + 0.004 * 16 * 20 / 1.44 / phantom().flow_mL_s(point.phase_s);
    EXPECT_NEAR(point.stiffness_kPa_per_mL->value, expected, 0.1 * expected);
    ++known;
  }
  EXPECT_GT(known, 5U);
  // What the page shows is read back as it was written.
  const FlowRecord record = flow_record(session);
  EXPECT_EQ(to_json(flow_record_from_json(to_json(record), "x")), to_json(record));
  EXPECT_EQ(record.images.size(), 12U);
}

}  // namespace
}  // namespace diastole::imaging
