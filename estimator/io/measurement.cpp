#include "estimator/io/measurement.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <tuple>

#include "estimator/io/number_table.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole {
namespace {

constexpr std::string_view frames_columns[] = {"frame", "time_s", "pressure_kPa", "sigma_kPa"};
constexpr std::string_view tags_columns[] = {"frame", "nx",   "ny",       "nz",     "plane_mm",    "x_mm",
                                             "y_mm",  "z_mm", "sigma_mm", "own_mm", "own_sigma_mm"};
constexpr size_t own_columns = 2;
constexpr std::string_view points_columns[] = {"frame", "X_mm", "Y_mm", "Z_mm",
                                               "x_mm",  "y_mm", "z_mm", "sigma_mm"};

constexpr double unit_tolerance = 1e-4;           // normals are written with six decimals
constexpr double plausible_pressure_kPa = 100.0;  // the pump stalls at 79 kPa

std::array<double, 3> vector_at(const NumberTable& table, size_t row, size_t column) {
  return {table.at(row, column), table.at(row, column + 1), table.at(row, column + 2)};
}

double norm(const std::array<double, 3>& v) { return std::hypot(v[0], v[1], v[2]); }

int frame_at(const NumberTable& table, size_t row, int frame_count) {
  const int frame = table.index_at(row, 0, 1'000'000);
  if (frame >= frame_count) {
    table.fail(
        row, 0,
        fmt::format("frame {} has no row in the frames file, which ends at frame {}", frame, frame_count - 1),
        "Add the frame's pressure to the frames file, or leave its points out.");
  }
  return frame;
}

double sigma_at(const NumberTable& table, size_t row, size_t column) {
  const double sigma_mm = table.at(row, column);
  if (!(sigma_mm > 0)) {
    table.fail(row, column, fmt::format("{} is not a standard deviation", sigma_mm),
               "Give the point's measurement error in mm, greater than 0.");
  }
  return sigma_mm;
}

/// The cylinder about z that holds a specimen.
struct Extent {
  double radius_mm;
  double low_mm;
  double high_mm;
};

Extent extent_of(const AnnulusSpecimen& annulus) {
  return {annulus.outer_radius_mm, -0.5 * annulus.height_mm, 0.5 * annulus.height_mm};
}
Extent extent_of(const EllipsoidSpecimen& ellipsoid) {
  return {ellipsoid.outer_axes_mm[0], -ellipsoid.outer_axes_mm[1], ellipsoid.base_z_mm};
}

std::optional<Extent> extent_of(const MeshSpecimen&) { return {}; }  // any shape, in any axes

// Refuses coordinates that cannot belong to the specimen: the first sign of wrong units or axes.
template <typename Row>
void check_extent(const std::vector<Row>& rows, const Specimen& specimen, const std::filesystem::path& path) {
  const auto known =
      std::visit([](const auto& kind) -> std::optional<Extent> { return extent_of(kind); }, specimen);
  if (!known) return;
  const Extent extent = *known;
  const double reach_mm =
      std::hypot(extent.radius_mm, std::max(std::abs(extent.low_mm), std::abs(extent.high_mm)));
  const double slack_mm = 0.25 * (extent.high_mm - extent.low_mm);
  double largest_mm = 0;
  size_t outside = 0;
  for (const Row& row : rows) {
    largest_mm = std::max(largest_mm, norm(row.x_mm));
    // The slack of a half lets the specimen bulge far; the axis must be z and the origin right all the same.
    if (std::hypot(row.x_mm[0], row.x_mm[1]) > 1.5 * extent.radius_mm ||
        row.x_mm[2] < extent.low_mm - slack_mm || row.x_mm[2] > extent.high_mm + slack_mm) {
      ++outside;
    }
  }
  if (largest_mm < 0.02 * reach_mm) {
    throw InputError(
        {path.string(), "columns x_mm, y_mm, z_mm",
         fmt::format("no point is farther than {:.3g} mm from the origin, but the specimen reaches {:.3g} mm",
                     largest_mm, reach_mm),
         "The coordinates seem to be in metres: multiply them by 1000."});
  }
  if (2 * outside > rows.size()) {
    throw InputError(
        {path.string(), "columns x_mm, y_mm, z_mm",
         fmt::format("{} of {} points lie far outside the specimen (radius {} mm, z from {} to {} mm)",
                     outside, rows.size(), extent.radius_mm, extent.low_mm, extent.high_mm),
         "Give coordinates in mm with the specimen's axis along z and its origin where the study has it."});
  }
}

}  // namespace

std::vector<Frame> read_frames(const std::filesystem::path& path) {
  const NumberTable table = NumberTable::from_file(path, frames_columns);
  std::vector<Frame> frames;
  for (size_t row = 0; row < table.rows(); ++row) {
    const int number = table.index_at(row, 0, 1'000'000);
    if (number != static_cast<int>(row)) {
      table.fail(row, 0, fmt::format("frame {} where frame {} belongs", number, row),
                 "List the frames 0, 1, 2, ... without leaving one out.");
    }
    const Frame frame{table.at(row, 1), table.at(row, 2), table.at(row, 3)};
    if (row > 0 && !(frame.time_s > frames.back().time_s)) {
      table.fail(row, 1, fmt::format("{} s does not follow {} s", frame.time_s, frames.back().time_s),
                 "Times must increase from frame to frame.");
    }
    if (std::abs(frame.pressure_kPa) > plausible_pressure_kPa) {
      table.fail(row, 2, fmt::format("{} kPa is beyond what the pump can make", frame.pressure_kPa),
                 "If this is Pa divide by 1000; if mmHg divide by 7.5006.");
    }
    if (frame.sigma_kPa < 0) {
      table.fail(row, 3, fmt::format("{} is not a standard deviation", frame.sigma_kPa),
                 "Give the pressure's measurement error in kPa; 0 means exactly known.");
    }
    frames.push_back(frame);
  }
  return frames;
}

std::vector<TagPoint> read_tags(const std::filesystem::path& path, int frame_count, bool* planes_as_seen) {
  const NumberTable table = NumberTable::from_file(path, tags_columns, own_columns);
  const bool has_own = table.columns() == std::size(tags_columns);
  if (planes_as_seen != nullptr) *planes_as_seen = has_own;
  std::vector<TagPoint> tags;
  tags.reserve(table.rows());
  for (size_t row = 0; row < table.rows(); ++row) {
    TagPoint tag{.frame = frame_at(table, row, frame_count),
                 .normal = vector_at(table, row, 1),
                 .plane_mm = table.at(row, 4),
                 .x_mm = vector_at(table, row, 5),
                 .sigma_mm = sigma_at(table, row, 8)};
    const double length = norm(tag.normal);
    if (std::abs(length - 1) > unit_tolerance) {
      table.fail(row, 1,
                 fmt::format("the normal ({}, {}, {}) has length {:.6g}", tag.normal[0], tag.normal[1],
                             tag.normal[2], length),
                 "Give the tag plane's unit normal, and plane_mm for that normal.");
    }
    for (double& component : tag.normal)
      component /= length;
    if (has_own) {
      for (size_t k = 0; k < 3; ++k)
        tag.x_mm[k] += table.at(row, 9) * tag.normal[k];
      tag.sigma_mm = sigma_at(table, row, 10);
    }
    tags.push_back(tag);
  }
  return tags;
}

std::vector<ObservedPoint> read_points(const std::filesystem::path& path, int frame_count) {
  const NumberTable table = NumberTable::from_file(path, points_columns);
  std::vector<ObservedPoint> points;
  points.reserve(table.rows());
  for (size_t row = 0; row < table.rows(); ++row) {
    points.push_back({.frame = frame_at(table, row, frame_count),
                      .X_mm = vector_at(table, row, 1),
                      .x_mm = vector_at(table, row, 4),
                      .sigma_mm = sigma_at(table, row, 7)});
  }
  return points;
}

namespace {

auto numbers_of(const TagPoint& t) {
  return std::make_tuple(t.frame, t.normal, t.plane_mm, t.x_mm, t.sigma_mm);
}
auto numbers_of(const ObservedPoint& p) { return std::make_tuple(p.frame, p.X_mm, p.x_mm, p.sigma_mm); }

/// Leaves each row once, in its order; how many went.
template <class Row>
size_t drop_repeated(std::vector<Row>& rows) {
  std::set<decltype(numbers_of(rows.front()))> seen;
  return std::erase_if(rows, [&](const Row& row) { return !seen.insert(numbers_of(row)).second; });
}

}  // namespace

Measurement read_measurement(const Study& study) {
  const StudyData& data = study.data;
  if (!data.tags && !data.points) {
    throw InputError(
        {study.file.string(), "table [data]", "neither tags nor points are named",
         "Add tags = \"NAME.tags.csv\" or points = \"NAME.points.csv\", and frames = \"NAME.frames.csv\"."});
  }
  Measurement measurement;
  measurement.frames = read_frames(*data.frames);
  const int frame_count = static_cast<int>(measurement.frames.size());
  if (data.tags) {
    measurement.tags = read_tags(*data.tags, frame_count, &measurement.planes_as_seen);
    check_extent(measurement.tags, study.specimen, *data.tags);
  }
  if (data.points) {
    measurement.points = read_points(*data.points, frame_count);
    check_extent(measurement.points, study.specimen, *data.points);
  }
  measurement.repeated_rows = drop_repeated(measurement.tags) + drop_repeated(measurement.points);
  return measurement;
}

}  // namespace diastole
