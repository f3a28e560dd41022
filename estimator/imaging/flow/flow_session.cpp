#include "estimator/imaging/flow/flow_session.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "estimator/imaging/series/grey_picture.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/runfile/flow_writer.hpp"
#include "protocol/runfile/reader.hpp"

namespace diastole::imaging {
namespace {

constexpr int curve_points = 240;
constexpr int outline_points = 72;
/// Around the lumen, so that wall and still material are seen.
constexpr int cut_margin_px = 8;

/// The window of the images and each phase's outline in it.
void add_images(FlowRecord& record, const FlowMeasurement& flow) {
  const SlicePlane& plane = flow.scan.plane;
  const Eigen::Vector2d pixel_mm(plane.column_spacing_mm, plane.row_spacing_mm);
  const LumenShape& shape = flow.lumen.shapes[0];
  const Eigen::Vector2d centre = shape.centre_mm.cwiseQuotient(pixel_mm);
  const auto window = [&](double middle, double radius, int count) {
    const int first = std::clamp(static_cast<int>(middle - radius) - cut_margin_px, 0, count - 1);
    const int last = std::clamp(static_cast<int>(middle + radius) + cut_margin_px, first, count - 1);
    return std::pair(first, last - first + 1);
  };
  const auto [first_column, columns] = window(centre.x(), shape.radius_mm / pixel_mm.x(), plane.columns);
  const auto [first_row, rows] = window(centre.y(), shape.radius_mm / pixel_mm.y(), plane.rows);
  record.rows = rows;
  record.columns = columns;
  float white = 1e-6F;
  for (const Image& image : flow.scan.magnitude)
    white = std::max(white, image.block(first_row, first_column, rows, columns).maxCoeff());
  for (size_t k = 0; k < flow.scan.phases(); ++k) {
    FlowImageRecord image;
    image.phase_s = flow.scan.time_s[k];
    const auto window_of = [&, r = first_row, c = first_column, h = rows, w = columns](const Image& whole) {
      return whole.block(r, c, h, w);
    };
    image.magnitude = grey_picture(window_of(flow.scan.magnitude[k]), white);
    image.velocity =
        grey_picture(0.5F + window_of(flow.scan.phase_rad[k]) / (2 * std::numbers::pi_v<float>), 1.0F);
    const LumenShape& here = flow.lumen.shapes[k];
    for (int i = 0; i < outline_points; ++i) {
      const double angle = 2 * std::numbers::pi * i / outline_points;
      const Eigen::Vector2d towards(std::cos(angle), std::sin(angle));
      const Eigen::Vector2d place =
          (here.centre_mm + here.edge_mm(towards) * towards).cwiseQuotient(pixel_mm);
      image.outline.push_back(place.x() - first_column);
      image.outline.push_back(place.y() - first_row);
    }
    record.images.push_back(std::move(image));
  }
}

}  // namespace

FlowSession measure_session(const FlowSessionRequest& request, const Stage& stage) {
  const auto say = [&](const std::string& what) {
    if (stage) stage(what);
  };
  FlowSession session;
  session.folder = request.folder.string();
  // A run that cannot be read is reported before the images are read.
  std::optional<runfile::RunFile> run;
  if (request.run) run = runfile::open_run(*request.run);
  std::optional<runfile::RecordedRun> tables;
  if (request.pressure) {
    tables = run_of_tables(*request.pressure, *request.trigger);
    run = {*tables, runfile::rows_of(*tables)};
  }
  say("Reading images.");
  const ImageFolder folder = read_image_folder(request.folder);
  require_sound(folder);
  session.findings = folder.problems;
  PhaseContrast scan = phase_contrast(folder, request.scan);
  say(fmt::format("Fitting the lumen of {} in {} phases.", scan.name, scan.phases()));
  session.flow = measure_flow(std::move(scan), request.flow, session.folder);
  session.findings.insert(session.findings.end(), session.flow.findings.begin(), session.flow.findings.end());
  if (!run) return session;
  session.loop = pressure_volume_loop(session.flow, *run, request.segment);
  session.findings.insert(session.findings.end(), session.loop->findings.begin(),
                          session.loop->findings.end());
  return session;
}

void store_in_run(const FlowSession& session, const std::filesystem::path& run, bool replace) {
  const size_t segment = session.loop->segment;
  const double offset_mL = runfile::open_run(run).run.segments.at(segment).offset_mL;
  runfile::FlowVolume volume;
  for (const PhaseFlow& phase : session.flow.phases) {
    volume.phase_s.push_back(phase.phase_s);
    volume.cavity_mL.push_back(offset_mL + phase.volume_mL.value);
    volume.sigma_mL.push_back(phase.volume_mL.sigma);
  }
  runfile::store_flow(run, segment, volume, replace);
}

FlowRecord flow_record(const FlowSession& session) {
  const FlowMeasurement& flow = session.flow;
  const double cm_s = flow.scan.cm_s_per_radian();
  FlowRecord record;
  record.folder = session.folder;
  record.series = flow.scan.name;
  record.venc_cm_s = flow.scan.venc_cm_s;
  record.venc_source = flow.scan.venc_source;
  record.interval_s = flow.interval_s();
  record.stroke_mL = flow.stroke_mL.value;
  record.stroke_sigma_mL = flow.stroke_mL.sigma;
  record.closure_mL = flow.closure_mL.value;
  record.closure_sigma_mL = flow.closure_mL.sigma;
  record.is_closed = flow.is_closed;
  record.background_order = flow.background.order;
  record.background_cm_s = cm_s * flow.background.at_lumen_rad;
  record.background_sigma_cm_s = cm_s * flow.background.sigma_rad;
  record.unwrapped = flow.unwrapped;
  record.area_mm2 = flow.lumen.area_mm2;
  record.movement_mm = flow.lumen.movement_mm;
  record.reduced_chi_square = flow.lumen.reduced_chi_square;
  for (const PhaseFlow& phase : flow.phases)
    record.phases.push_back({phase.phase_s, phase.flow_mL_s.value, phase.flow_mL_s.sigma,
                             phase.volume_mL.value, phase.volume_mL.sigma, phase.core_cm_s, phase.turns});
  for (int i = 0; i <= curve_points; ++i) {
    const double t = flow.interval_s() * i / curve_points;
    const ValueWithError rate = flow.flow_at(t), volume = flow.volume_at(t);
    record.time_s.push_back(t);
    record.flow_mL_s.push_back(rate.value);
    record.flow_sigma_mL_s.push_back(rate.sigma);
    record.volume_mL.push_back(volume.value);
    record.volume_sigma_mL.push_back(volume.sigma);
  }
  if (session.loop) {
    record.pressure_source = session.loop->source;
    record.work_mJ = session.loop->work_mJ.value;
    record.work_sigma_mJ = session.loop->work_mJ.sigma;
    for (const LoopPoint& point : session.loop->points) {
      constexpr double none = std::numeric_limits<double>::quiet_NaN();
      const ValueWithError stiffness = point.stiffness_kPa_per_mL.value_or(ValueWithError{none, none});
      record.loop.push_back({point.phase_s, point.volume_mL.value, point.volume_mL.sigma,
                             point.pressure_kPa.value, point.pressure_kPa.sigma, stiffness.value,
                             stiffness.sigma});
    }
  }
  add_images(record, flow);
  record.findings = session.findings;
  return record;
}

}  // namespace diastole::imaging
