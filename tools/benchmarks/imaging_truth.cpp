#include "tools/benchmarks/imaging_truth.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "protocol/contract/input_error.hpp"
#include "protocol/runfile/h5_handle.hpp"

namespace diastole {
namespace {

using namespace runfile;

class File {
 public:
  explicit File(const std::filesystem::path& path) : name_(path.string()) {
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
    file_ = FileHandle(H5Fopen(name_.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT));
    if (!file_.valid()) fail("the file");
  }

  /// All numbers of a dataset, the last index fastest.
  [[nodiscard]] std::vector<double> numbers(const std::string& path) const {
    const DatasetHandle data(H5Dopen2(file_.get(), path.c_str(), H5P_DEFAULT));
    const SpaceHandle space(data.valid() ? H5Dget_space(data.get()) : H5I_INVALID_HID);
    const hssize_t count = space.valid() ? H5Sget_simple_extent_npoints(space.get()) : -1;
    if (count < 0) fail(path);
    std::vector<double> values(static_cast<size_t>(count));
    if (H5Dread(data.get(), H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) < 0) fail(path);
    return values;
  }
  [[nodiscard]] double attribute(const std::string& object, const char* name) const {
    const AttributeHandle attribute(
        H5Aopen_by_name(file_.get(), object.c_str(), name, H5P_DEFAULT, H5P_DEFAULT));
    double value = 0;
    if (!attribute.valid() || H5Aread(attribute.get(), H5T_NATIVE_DOUBLE, &value) < 0)
      fail(object + " attribute " + name);
    return value;
  }
  [[nodiscard]] std::vector<std::string> children(const std::string& path) const {
    std::vector<std::string> names;
    const GroupHandle group(H5Gopen2(file_.get(), path.c_str(), H5P_DEFAULT));
    if (!group.valid()) fail(path);
    H5Literate(
        group.get(), H5_INDEX_NAME, H5_ITER_INC, nullptr,
        [](hid_t, const char* name, const H5L_info_t*, void* into) -> herr_t {
          static_cast<std::vector<std::string>*>(into)->emplace_back(name);
          return 0;
        },
        &names);
    return names;
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw InputError({name_, what, "cannot be read", "Give the truth.h5 of a labelled set of images."});
  }

  std::string name_;
  FileHandle file_;
};

Eigen::Vector3d vector_at(const std::vector<double>& numbers, size_t row) {
  return {numbers[3 * row], numbers[3 * row + 1], numbers[3 * row + 2]};
}

std::vector<std::vector<double>> by_phase(const std::vector<double>& numbers, size_t phases) {
  std::vector<std::vector<double>> parts;
  const size_t size = numbers.size() / phases;
  for (size_t k = 0; k < phases; ++k)
    parts.emplace_back(numbers.begin() + static_cast<std::ptrdiff_t>(k * size),
                       numbers.begin() + static_cast<std::ptrdiff_t>((k + 1) * size));
  return parts;
}

/// Cell and share of a value on an even grid; the border's cell beyond it.
struct Cell {
  size_t at;
  double share;
};

Cell cell_of(const std::vector<double>& grid, double value) {
  const double place = (value - grid.front()) / (grid[1] - grid[0]);
  const double low = std::clamp(std::floor(place), 0.0, static_cast<double>(grid.size() - 2));
  return {static_cast<size_t>(low), std::clamp(place - low, 0.0, 1.0)};
}

}  // namespace

Eigen::Vector3d ImagingTruth::material_mm(size_t phase, const Eigen::Vector3d& x_mm) const {
  const double radius = std::hypot(x_mm.x(), x_mm.y());
  const Cell r = cell_of(r_mm, radius), z = cell_of(z_mm, x_mm.z());
  const auto between = [&](const std::vector<double>& table) {
    const size_t at = r.at * z_mm.size() + z.at;
    return (1 - r.share) * ((1 - z.share) * table[at] + z.share * table[at + 1]) +
           r.share * ((1 - z.share) * table[at + z_mm.size()] + z.share * table[at + z_mm.size() + 1]);
  };
  const double factor = between(R_mm[phase]) / std::max(radius, 1e-9);
  const double c = factor * std::cos(between(twist_rad[phase]));
  const double s = factor * std::sin(between(twist_rad[phase]));
  return {c * x_mm.x() + s * x_mm.y(), c * x_mm.y() - s * x_mm.x(), between(Z_mm[phase])};
}

double ImagingTruth::depth_mm(const Eigen::Vector3d& X_mm) const {
  const double R = std::hypot(X_mm.x(), X_mm.y()), Z = X_mm.z();
  if (!is_ventricle) return std::min({R - 22.5, 50.0 - R, 42.5 - std::abs(Z)});
  // Eq. 5: half axes 21 + 9 t and 51 + 9 t mm, t from 0 inside to 1 outside, cut at z = 15 mm.
  double low = -0.6, high = 1.6;
  for (int step = 0; step < 50; ++step) {
    const double t = 0.5 * (low + high);
    const double across = 21 + 9 * t, along = 51 + 9 * t;
    (std::pow(R / across, 2) + std::pow(Z / along, 2) > 1 ? low : high) = t;
  }
  return std::min({9 * low, 9 * (1 - low), 15 - Z});
}

ImagingTruth read_imaging_truth(const std::filesystem::path& path) {
  const File file(path);
  ImagingTruth truth;
  truth.pixel_mm = file.attribute("/", "pixel_mm");
  truth.times_s = file.numbers("/phase/time_s");
  const size_t phases = truth.times_s.size();
  truth.origin_mm = vector_at(file.numbers("/pose/origin_mm"), 0);
  const std::vector<double> axes = file.numbers("/pose/axes");
  for (size_t row = 0; row < 3; ++row)
    truth.axes.row(static_cast<Eigen::Index>(row)) = vector_at(axes, row);
  for (const std::string& series : file.children("/series")) {
    const std::string group = "/series/" + series;
    const double spacing_mm = file.attribute(group, "tag_spacing_mm");
    const std::vector<double> normals = file.numbers(group + "/n_specimen");
    const std::vector<double> d_mm = file.numbers(group + "/d_specimen_mm");
    const size_t first = truth.families.size();
    for (size_t f = 0; f < d_mm.size(); ++f)
      truth.families.push_back({vector_at(normals, f), d_mm[f], spacing_mm});
    const std::vector<double> index = file.numbers(group + "/points/index");
    const std::vector<double> x_mm = file.numbers(group + "/points/x_mm");
    for (size_t i = 0; 4 * i < index.size(); ++i)
      truth.points.push_back({static_cast<size_t>(index[4 * i]) - 1,
                              first + static_cast<size_t>(index[4 * i + 2]),
                              static_cast<int>(index[4 * i + 3]),
                              truth.axes.transpose() * (vector_at(x_mm, i) - truth.origin_mm)});
  }
  truth.r_mm = file.numbers("/motion/r_mm");
  truth.z_mm = file.numbers("/motion/z_mm");
  truth.R_mm = by_phase(file.numbers("/motion/R_mm"), phases);
  truth.Z_mm = by_phase(file.numbers("/motion/Z_mm"), phases);
  truth.twist_rad = by_phase(file.numbers("/motion/T_rad"), phases);
  const std::vector<double> X_mm = file.numbers("/grid/X_mm");  // patient coordinates, as the points'
  for (size_t i = 0; 3 * i < X_mm.size(); ++i)
    truth.grid.X_mm.push_back(truth.axes.transpose() * (vector_at(X_mm, i) - truth.origin_mm));
  for (const std::vector<double>& u_mm : by_phase(file.numbers("/grid/u_mm"), phases)) {
    truth.grid.u_mm.emplace_back();
    for (size_t i = 0; 3 * i < u_mm.size(); ++i)
      truth.grid.u_mm.back().push_back(truth.axes.transpose() * vector_at(u_mm, i));
  }
  return truth;
}

}  // namespace diastole
