#include "tools/sim_scanner/scanner.hpp"

#include <fmt/format.h>

#include <atomic>
#include <cmath>
#include <mutex>
#include <random>

#include "estimator/parallel/parallel_for.hpp"
#include "protocol/contract/angle.hpp"
#include "tools/sim_scanner/dicom_image.hpp"

namespace diastole::scanner {
namespace {

/// Slices of one orientation with the same tags.
struct Series {
  ScannedSeries report;
  std::vector<size_t> planes;               // among the protocol's
  std::vector<std::vector<TagPlane>> tags;  // of each of them
};

/// Unique identifiers made of whole numbers (2.25, PS3.5 B.2): the same for the same seed.
std::string uid(unsigned seed, int series, int image) {
  return fmt::format("2.25.{}", (seed + 1ULL) * 1000000000ULL + static_cast<unsigned>(series) * 1000000ULL +
                                    static_cast<unsigned>(image));
}

std::vector<Series> series_of(const ScanProtocol& protocol) {
  std::mt19937 engine(protocol.seed);
  std::uniform_real_distribution<double> anywhere(0, protocol.tags.spacing_mm);
  std::vector<std::vector<double>> directions;
  if (protocol.tagged && protocol.tags.grid) directions.push_back(protocol.tags.angles_deg);
  if (protocol.tagged && !protocol.tags.grid) {
    for (const double angle_deg : protocol.tags.angles_deg)
      directions.push_back({angle_deg});
  }
  if (protocol.cine) directions.emplace_back();
  std::vector<Series> all;
  const std::vector<ScanPlane> planes = planes_of(protocol);
  for (size_t first = 0; first < planes.size();) {
    size_t end = first + 1;
    while (end < planes.size() && planes[end].view == planes[first].view)
      ++end;
    for (const std::vector<double>& angles_deg : directions) {
      Series series;
      series.report = {static_cast<int>(all.size()) + 2, angles_deg.empty() ? "cine" : "tagged cine",
                       planes[first].view, angles_deg, 0};
      for (size_t i = first; i < end; ++i) {
        series.planes.push_back(i);
        std::vector<TagPlane> tags;
        for (const double angle_deg : angles_deg) {
          const double angle = angle_deg * rad_per_deg;
          tags.push_back({std::cos(angle) * planes[i].along_row + std::sin(angle) * planes[i].along_column,
                          anywhere(engine)});
        }
        series.tags.push_back(std::move(tags));
      }
      all.push_back(std::move(series));
    }
    first = end;
  }
  return all;
}

void write_image(const MovingBody& body, const ScanProtocol& protocol, const ScanPose& pose,
                 const SliceOfBody& slice, const Series& series, size_t which, size_t phase,
                 const std::filesystem::path& folder, int instance) {
  const ScanPlane plane = planes_of(protocol)[series.planes[which]];
  const Picture signal = signal_of(slice, plane, protocol, series.tags[which], body.times_s[phase]);
  const int number = series.report.number;
  const ImageLabel label{.study_uid = uid(protocol.seed, 0, 0),
                         .series_uid = uid(protocol.seed, number, 0),
                         .image_uid = uid(protocol.seed, number, instance),
                         .series_number = number,
                         .instance = instance,
                         .trigger_ms = 1e3 * body.times_s[phase],
                         .interval_ms = 1e3 * body.period_s,
                         .first_mm = pose.origin_mm + pose.axes * plane.first_mm,
                         .along_row = pose.axes * plane.along_row,
                         .along_column = pose.axes * plane.along_column,
                         .pixel_mm = protocol.field_of_view_mm / protocol.matrix,
                         .thickness_mm = protocol.thickness_mm};
  const auto seed = static_cast<unsigned>(1000003U * protocol.seed + 1009U * static_cast<unsigned>(number) +
                                          static_cast<unsigned>(instance));
  write_dicom(folder / fmt::format("s{:02}_i{:04}.dcm", number, instance), acquired(signal, protocol, seed),
              label);
}

}  // namespace

std::vector<ScannedSeries> scan(const MovingBody& body, const ScanProtocol& protocol, const ScanPose& pose,
                                const std::filesystem::path& folder,
                                const std::function<void(size_t, size_t)>& progress) {
  std::vector<Series> all = series_of(protocol);
  const std::vector<ScanPlane> planes = planes_of(protocol);
  const size_t phases = body.times_s.size();
  size_t images = 0;
  for (Series& series : all) {
    series.report.files = series.planes.size() * phases;
    images += series.report.files;
  }
  std::atomic<size_t> done = 0;
  std::mutex reporting;
  // One slice of the body in one phase serves all directions of tags.
  parallel_for(planes.size() * phases, machine_threads(), [&](size_t i) {
    const size_t phase = i % phases;
    const SliceOfBody slice(*body.mesh, body.position_mm[phase], planes[i / phases],
                            protocol.field_of_view_mm, protocol.thickness_mm);
    for (const Series& series : all) {
      for (size_t p = 0; p < series.planes.size(); ++p) {
        if (series.planes[p] != i / phases) continue;
        const int instance = static_cast<int>(p * phases + phase) + 1;
        write_image(body, protocol, pose, slice, series, p, phase, folder, instance);
        const size_t count = ++done;
        if (!progress) continue;
        const std::scoped_lock lock(reporting);
        progress(count, images);
      }
    }
  });
  std::vector<ScannedSeries> reports;
  for (const Series& series : all)
    reports.push_back(series.report);
  return reports;
}

}  // namespace diastole::scanner
