#include "estimator/imaging/diffusion/nifti_series.hpp"

#include <fmt/format.h>
#include <nifti1_io.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <optional>
#include <sstream>

#include "estimator/io/whole_file.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole::imaging {
namespace {

namespace fs = std::filesystem;

/// Beyond any diffusion study; bounds what a header can ask for.
constexpr int64_t most_values = int64_t{1} << 31U;

[[noreturn]] void refuse(const fs::path& file, std::string place, std::string problem, std::string remedy) {
  throw InputError({file.string(), std::move(place), std::move(problem), std::move(remedy)});
}

bool is_image(const fs::path& file) {
  const std::string name = file.filename().string();
  return name.ends_with(".nii") || name.ends_with(".nii.gz");
}

/// dwi.nii.gz -> dwi
fs::path stem_of(const fs::path& image) {
  fs::path stem = image;
  if (stem.extension() == ".gz") stem.replace_extension();
  return stem.replace_extension();
}

/// Tables have nan where there is nothing to say, as for the direction of an image without weighting.
enum class Nan { refused, kept };

/// Numbers by white space, line by line; empty lines do not count.
std::vector<std::vector<double>> read_rows(const fs::path& file, Nan nan) {
  std::istringstream lines(read_whole_file(file, "Export the table beside the image (dcm2niix writes it)."));
  std::vector<std::vector<double>> rows;
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    std::istringstream words(line);
    std::vector<double> row;
    for (std::string word; words >> word;) {
      char* end = nullptr;
      const double value = std::strtod(word.c_str(), &end);
      const bool known = std::isfinite(value) || (nan == Nan::kept && std::isnan(value));
      if (*end != '\0' || !known)
        refuse(file, fmt::format("line {}", number), fmt::format("\"{}\" is no number", word),
               "Export the table again.");
      row.push_back(value);
    }
    if (!row.empty()) rows.push_back(std::move(row));
  }
  return rows;
}

std::vector<double> read_b_values(const fs::path& file, size_t volumes) {
  std::vector<double> values;
  for (const std::vector<double>& row : read_rows(file, Nan::refused))
    values.insert(values.end(), row.begin(), row.end());
  if (values.size() != volumes)
    refuse(file, "", fmt::format("has {} b values, and the image {} volumes", values.size(), volumes),
           "Image and tables must be of one export.");
  for (const double b : values)
    if (b < 0) refuse(file, "", fmt::format("{} s/mm\u00b2 is negative", b), "Give b values in s/mm\u00b2.");
  const double largest = *std::max_element(values.begin(), values.end());
  if (largest > 0 && largest < DiffusionSeries::unweighted_s_mm2)
    refuse(file, "", fmt::format("its largest b value is {:g}, which in s/mm\u00b2 weights nothing", largest),
           fmt::format("Give b values in s/mm\u00b2: {0:g} ms/\u00b5m\u00b2 are {1:g} s/mm\u00b2.", largest,
                       1000 * largest));
  return values;
}

/// Three rows, or three columns; nan for a volume without one.
std::vector<Eigen::Vector3d> read_directions(const fs::path& file, size_t volumes) {
  const std::vector<std::vector<double>> rows = read_rows(file, Nan::kept);
  const auto all_of_length = [&](size_t length) {
    return std::all_of(rows.begin(), rows.end(), [&](const auto& row) { return row.size() == length; });
  };
  std::vector<Eigen::Vector3d> directions(volumes);
  if (rows.size() == 3 && all_of_length(volumes)) {
    for (size_t v = 0; v < volumes; ++v)
      directions[v] = {rows[0][v], rows[1][v], rows[2][v]};
  } else if (rows.size() == volumes && all_of_length(3)) {
    for (size_t v = 0; v < volumes; ++v)
      directions[v] = {rows[v][0], rows[v][1], rows[v][2]};
  } else {
    refuse(file, "", fmt::format("is not 3 rows of {} numbers, one direction a volume", volumes),
           "Image and tables must be of one export.");
  }
  return directions;
}

/// Several shells at one nominal b value are played with gradients of other amplitudes, which shortens directions: the weighting is b |g|², as
/// MRtrix reads such tables. Lengths of tables of two decimals are right within 1 %.
constexpr double unit_length_tolerance = 0.05;

/// Makes directions unit vectors. Nothing where all weighted ones are of one length: such a table is only not normalised.
std::optional<Finding> scale_by_lengths(std::vector<double>& b, std::vector<Eigen::Vector3d>& directions,
                                        const std::string& table) {
  std::vector<double> lengths;
  for (size_t v = 0; v < b.size(); ++v)
    if (b[v] >= DiffusionSeries::unweighted_s_mm2 && directions[v].norm() > 0)
      lengths.push_back(directions[v].norm());
  if (lengths.empty()) return std::nullopt;
  const auto [shortest, longest] = std::minmax_element(lengths.begin(), lengths.end());
  const bool scales = *shortest < (1 - unit_length_tolerance) * *longest;
  for (size_t v = 0; v < b.size(); ++v) {
    const double length = directions[v].norm();
    if (!(length > 0)) continue;
    if (scales) b[v] *= length * length;
    directions[v] /= length;
  }
  if (!scales) return std::nullopt;
  return Finding{
      Severity::note,
      "gradient-lengths",
      fmt::format("directions have lengths of {:.2f} to {:.2f}: b values are multiplied by their squares",
                  *shortest, *longest),
      table,
      *shortest,
      "",
      "So shells at one nominal b value are written. If the table is only not normalised, give unit "
      "vectors."};
}

struct FreeImage {
  void operator()(nifti_image* image) const { nifti_image_free(image); }
};
using NiftiImage = std::unique_ptr<nifti_image, FreeImage>;

template <class Number>
float value_at(const void* data, size_t index) {
  return static_cast<float>(static_cast<const Number*>(data)[index]);
}

using ValueAt = float (*)(const void*, size_t);

ValueAt reader_of(int datatype) {
  switch (datatype) {
    case DT_UINT8:
      return value_at<uint8_t>;
    case DT_INT8:
      return value_at<int8_t>;
    case DT_INT16:
      return value_at<int16_t>;
    case DT_UINT16:
      return value_at<uint16_t>;
    case DT_INT32:
      return value_at<int32_t>;
    case DT_UINT32:
      return value_at<uint32_t>;
    case DT_FLOAT32:
      return value_at<float>;
    case DT_FLOAT64:
      return value_at<double>;
    default:
      return nullptr;
  }
}

NiftiImage load(const fs::path& file) {
  nifti_set_debug_level(0);  // what is wrong with a file is said by this program
  NiftiImage header(nifti_image_read(file.c_str(), 0));
  if (!header)
    refuse(file, "header", "is no NIfTI image, or ends within its header", "Copy or export the file again.");
  const int64_t nx = header->nx, ny = header->ny, nz = header->nz, nt = header->nt;
  if (nx < 1 || ny < 1 || nz < 1 || nt < 1 || nx * ny * nz * nt > most_values || header->ndim > 4)
    refuse(file, "dim", fmt::format("{} x {} x {} x {} voxels are no diffusion series", nx, ny, nz, nt),
           "Export the series as one four-dimensional image.");
  if (header->sform_code <= 0 && header->qform_code <= 0)
    refuse(file, "qform_code, sform_code", "says not where the image lies",
           "Export it with dcm2niix, which keeps the patient coordinates.");
  if (reader_of(header->datatype) == nullptr)
    refuse(file, "datatype", fmt::format("values of type {} are not read", header->datatype),
           "Export the image as integers or real numbers.");
  return header;
}

/// The voxels, in this machine's byte order. (nifti_image_load takes a file that is cut short for a whole one.)
std::vector<char> voxels_of(const nifti_image& header, const fs::path& file) {
  const size_t voxels = header.nvox, bytes = voxels * static_cast<size_t>(header.nbyper);
  // Deflate makes a thousandth of nothing at best; memory is not asked for on a header's word alone.
  const bool packed = file.extension() == ".gz";
  const auto in_file = static_cast<size_t>(fs::file_size(file)) * (packed ? 1100 : 1);
  std::vector<char> data;
  bool whole = in_file >= bytes;
  if (whole) {
    data.resize(bytes);
    znzFile stream = znzopen(file.c_str(), "rb", packed ? 1 : 0);
    whole = !znz_isnull(stream) && znzseek(stream, header.iname_offset, SEEK_SET) >= 0 &&
            znzread(data.data(), 1, bytes, stream) == bytes;
    if (!znz_isnull(stream)) Xznzclose(&stream);
  }
  if (!whole)
    refuse(file, "voxels", fmt::format("the file ends before the {} voxels that it announces", voxels),
           "Copy or export the file again.");
  if (header.byteorder != nifti_short_order() && header.swapsize > 1)
    nifti_swap_Nbytes(bytes / static_cast<size_t>(header.swapsize), header.swapsize, data.data());
  return data;
}

/// Voxel (i, j, k) to patient coordinates (LPS, mm).
struct VoxelMap {
  Eigen::Matrix3d axes;  ///< columns: a step along i, j, k
  Eigen::Vector3d origin_mm;
};

VoxelMap voxel_map(const nifti_image& image) {
  const mat44& m = image.sform_code > 0 ? image.sto_xyz : image.qto_xyz;
  VoxelMap map;
  for (int i = 0; i < 3; ++i) {
    const double sign = i < 2 ? -1 : 1;  // right, anterior -> left, posterior
    for (int j = 0; j < 3; ++j)
      map.axes(i, j) = sign * static_cast<double>(m.m[i][j]);
    map.origin_mm[i] = sign * static_cast<double>(m.m[i][3]);
  }
  return map;
}

SlicePlane plane_of(const nifti_image& image, const VoxelMap& map, int k) {
  SlicePlane plane;
  plane.origin_mm = map.origin_mm + k * map.axes.col(2);
  plane.along_row = map.axes.col(0).normalized();
  plane.along_column = map.axes.col(1).normalized();
  plane.column_spacing_mm = map.axes.col(0).norm();
  plane.row_spacing_mm = map.axes.col(1).norm();
  plane.rows = static_cast<int>(image.ny);
  plane.columns = static_cast<int>(image.nx);
  plane.thickness_mm = map.axes.col(2).norm();
  return plane;
}

Image slice_of(const nifti_image& image, const std::vector<char>& voxels, ValueAt value, int k, int t) {
  const auto nx = static_cast<size_t>(image.nx), ny = static_cast<size_t>(image.ny),
             nz = static_cast<size_t>(image.nz);
  const float slope = image.scl_slope != 0 ? static_cast<float>(image.scl_slope) : 1.0F;
  const auto intercept = static_cast<float>(image.scl_inter);
  Image pixels(image.ny, image.nx);
  for (size_t j = 0; j < ny; ++j) {
    for (size_t i = 0; i < nx; ++i) {
      const size_t index = i + nx * (j + ny * (static_cast<size_t>(k) + nz * static_cast<size_t>(t)));
      const float scaled = slope * value(voxels.data(), index) + intercept;
      // Masked voxels are often no numbers.
      pixels(static_cast<Eigen::Index>(j), static_cast<Eigen::Index>(i)) =
          std::isfinite(scaled) ? scaled : 0.0F;
    }
  }
  return pixels;
}

}  // namespace

std::optional<NiftiFiles> nifti_files(const fs::path& folder) {
  std::error_code error;
  std::vector<fs::path> images;
  if (fs::is_regular_file(folder, error) && is_image(folder)) images.push_back(folder);
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error))
    if (is_image(at->path())) images.push_back(at->path());
  if (images.empty()) return std::nullopt;
  std::sort(images.begin(), images.end());
  std::vector<NiftiFiles> complete;
  for (const fs::path& image : images) {
    const fs::path stem = stem_of(image);
    const NiftiFiles files{image, stem.string() + ".bval", stem.string() + ".bvec"};
    if (fs::exists(files.bval) && fs::exists(files.bvec)) complete.push_back(files);
  }
  if (complete.empty())
    refuse(
        images[0], "", "has no tables of b values and directions beside it",
        fmt::format("Put {0}.bval and {0}.bvec beside the image.", stem_of(images[0]).filename().string()));
  if (complete.size() > 1)
    refuse(folder, "", fmt::format("holds {} NIfTI diffusion series", complete.size()),
           fmt::format("Name one, for example {}.", complete[0].image.string()));
  return complete[0];
}

DiffusionSeries read_nifti(const NiftiFiles& files) {
  const NiftiImage image = load(files.image);
  const std::vector<char> voxels = voxels_of(*image, files.image);
  const ValueAt value = reader_of(image->datatype);
  const auto volumes = static_cast<size_t>(image->nt);
  std::vector<double> b = read_b_values(files.bval, volumes);
  std::vector<Eigen::Vector3d> directions = read_directions(files.bvec, volumes);
  const VoxelMap map = voxel_map(*image);
  Eigen::Matrix3d axes = map.axes.colwise().normalized();
  constexpr double least_volume =
      0.1;  // of what unit axes span; slices that are sheared more are no image of a scanner
  if (!(std::abs(axes.determinant()) > least_volume))
    refuse(files.image, "sform, qform", "its axes do not span space",
           "Export it with dcm2niix, which keeps the patient coordinates.");
  // Of LPS the determinant is that of RAS: two signs are reversed.
  if (axes.determinant() > 0) axes.col(0) *= -1;

  DiffusionSeries series;
  series.table_axes = axes;
  if (auto scaled = scale_by_lengths(b, directions, files.bvec.filename().string()))
    series.findings.push_back(*scaled);
  series.name = files.image.filename().string();
  series.encoding = files.bval.filename().string() + ", " + files.bvec.filename().string();
  for (int k = 0; k < image->nz; ++k)
    series.slices.push_back(plane_of(*image, map, k));
  for (size_t t = 0; t < volumes; ++t) {
    DiffusionVolume volume;
    volume.b_matrix.setZero();
    if (b[t] > 0 && directions[t].norm() > 0) {
      const Eigen::Vector3d g = axes * directions[t];
      volume.b_matrix = b[t] * g * g.transpose();
    } else if (b[t] >= DiffusionSeries::unweighted_s_mm2) {
      refuse(files.bvec, fmt::format("volume {}", t + 1),
             fmt::format("has no direction, and its b value is {:.0f} s/mm\u00b2", b[t]),
             "Remove trace images from the export.");
    }
    for (const DiffusionVolume& other : series.volumes)
      if ((other.b_matrix - volume.b_matrix).norm() < 1e-6) ++volume.repetition;
    for (int k = 0; k < image->nz; ++k)
      volume.images.emplace_back(slice_of(*image, voxels, value, k, static_cast<int>(t)));
    series.volumes.push_back(std::move(volume));
  }
  return series;
}

}  // namespace diastole::imaging
