#include "tests/estimator/imaging/diffusion_scan.hpp"

#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dctk.h>
#include <fmt/format.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <numbers>
#include <random>
#include <stdexcept>

namespace diastole::test {
namespace {

/// Depth in the wall, 0 to 1, of a place in the ventricle's axes.
std::optional<double> depth_at(const Eigen::Vector3d& x) {
  const double radius = std::hypot(x.x(), x.y());
  const auto outside = [&](double t) {
    return std::hypot(radius / (DiffusionScan::inner_mm + DiffusionScan::wall_mm * t),
                      x.z() / (DiffusionScan::inner_long_mm + DiffusionScan::wall_mm * t)) > 1;
  };
  if (x.z() > DiffusionScan::base_mm || !outside(0) || outside(1)) return std::nullopt;
  double low = 0, high = 1;
  for (int i = 0; i < 40; ++i) {
    const double middle = 0.5 * (low + high);
    (outside(middle) ? low : high) = middle;
  }
  return low;
}

/// f in the ventricle's axes.
Eigen::Vector3d local_fibre(const DiffusionScan& scan, const Eigen::Vector3d& x, double t) {
  const double a = DiffusionScan::inner_mm + DiffusionScan::wall_mm * t;
  const double c = DiffusionScan::inner_long_mm + DiffusionScan::wall_mm * t;
  const double theta = std::atan2(x.y(), x.x()), psi = std::atan2(std::hypot(x.x(), x.y()) / a, -x.z() / c);
  const Eigen::Vector3d circumferential(-std::sin(theta), std::cos(theta), 0);
  const Eigen::Vector3d longitudinal = Eigen::Vector3d(a * std::cos(psi) * std::cos(theta),
                                                       a * std::cos(psi) * std::sin(theta), c * std::sin(psi))
                                           .normalized();
  const double alpha = std::numbers::pi / 180 *
                       (std::lerp(scan.endo_deg, scan.epi_deg, t) + scan.helix_around_deg * std::cos(theta));
  return std::cos(alpha) * circumferential + std::sin(alpha) * longitudinal;
}

struct Grid {
  Eigen::Vector3d first_mm;  ///< the first slice's first pixel, ventricle's axes
};

Grid grid_of(const DiffusionScan& scan) {
  const double half = 0.5 * scan.pixel_mm * (scan.pixels - 1);
  return {{-half, -half, DiffusionScan::base_mm + 1.5 - scan.thickness_mm * (scan.slices - 0.5)}};
}

/// volume, slice, row, column
std::vector<std::vector<std::vector<double>>> signals_of(const DiffusionScan& scan) {
  std::mt19937 engine(1);
  std::normal_distribution<double> noise(0, 1);
  const auto volumes = scan.volumes();
  const Grid grid = grid_of(scan);
  const auto pixels = static_cast<size_t>(scan.pixels * scan.pixels);
  std::vector<std::vector<std::vector<double>>> signals(
      volumes.size(), {static_cast<size_t>(scan.slices), std::vector<double>(pixels)});
  for (int slice = 0; slice < scan.slices; ++slice) {
    for (size_t p = 0; p < pixels; ++p) {
      const Eigen::Vector3d corner =
          grid.first_mm +
          Eigen::Vector3d(scan.pixel_mm * static_cast<double>(p % static_cast<size_t>(scan.pixels)),
                          scan.pixel_mm * static_cast<double>(p / static_cast<size_t>(scan.pixels)),
                          scan.thickness_mm * slice);
      std::vector<Eigen::Matrix3d> tensors;
      constexpr int parts = 3;
      double empty = 0;
      for (int i = 0; i < parts * parts * parts; ++i) {
        const Eigen::Vector3d within((i % parts + 0.5) / parts - 0.5, (i / parts % parts + 0.5) / parts - 0.5,
                                     (i / parts / parts + 0.5) / parts - 0.5);
        const Eigen::Vector3d x =
            corner + within.cwiseProduct(Eigen::Vector3d(scan.pixel_mm, scan.pixel_mm, scan.thickness_mm));
        if (depth_at(x))
          tensors.push_back(scan.tensor(scan.origin_mm + scan.axes * x));
        else
          empty += 1;
      }
      for (size_t v = 0; v < volumes.size(); ++v) {
        double signal = 20 * empty;  // PFPE: dark
        for (const Eigen::Matrix3d& tensor : tensors) {
          const double weighting =
              1e-3 * volumes[v].first * volumes[v].second.dot(tensor * volumes[v].second);
          signal += 1000 * std::exp(-weighting + scan.kurtosis * weighting * weighting / 6);
        }
        signal /= parts * parts * parts;
        if (scan.faded.contains({static_cast<int>(v), slice})) signal *= 0.5;
        const double imaginary = scan.noise * noise(engine), real = signal + scan.noise * noise(engine);
        signals[v][static_cast<size_t>(slice)][p] = std::hypot(real, imaginary);
      }
    }
  }
  return signals;
}

void put(DcmItem& data, const DcmTagKey& tag, const std::string& value) {
  if (data.putAndInsertString(tag, value.c_str()).bad()) throw std::runtime_error("cannot write " + value);
}

void put_vector(DcmItem& data, const DcmTag& tag, const std::vector<double>& values) {
  data.putAndInsertFloat64Array(tag, values.data(), values.size());
}

void put_encoding(DcmDataset& data, DiffusionTags tags, double b, const Eigen::Vector3d& g) {
  const Eigen::Matrix3d matrix = b * g * g.transpose();
  const std::vector<double> upper{matrix(0, 0), matrix(0, 1), matrix(0, 2),
                                  matrix(1, 1), matrix(1, 2), matrix(2, 2)};
  if (tags == DiffusionTags::standard) {
    data.putAndInsertFloat64(DCM_DiffusionBValue, b);
    if (b > 0) put_vector(data, DCM_DiffusionGradientOrientation, {g.x(), g.y(), g.z()});
  } else if (tags == DiffusionTags::b_matrix) {
    size_t i = 0;
    DcmItem* item = nullptr;
    data.findOrCreateSequenceItem(DCM_DiffusionBMatrixSequence, item, 0);
    for (const DcmTagKey& tag : {DCM_DiffusionBValueXX, DCM_DiffusionBValueXY, DCM_DiffusionBValueXZ,
                                 DCM_DiffusionBValueYY, DCM_DiffusionBValueYZ, DCM_DiffusionBValueZZ})
      item->putAndInsertFloat64(tag, upper[i++]);
  } else if (tags == DiffusionTags::siemens) {
    data.putAndInsertString(DcmTag(0x0019, 0x0010, EVR_LO), "SIEMENS MR HEADER");
    data.putAndInsertString(DcmTag(0x0019, 0x100c, EVR_IS), fmt::format("{:.0f}", b).c_str());
    if (b == 0) return;
    put_vector(data, DcmTag(0x0019, 0x100e, EVR_FD), {g.x(), g.y(), g.z()});
    put_vector(data, DcmTag(0x0019, 0x1027, EVR_FD), upper);
  }
}

}  // namespace

std::vector<std::pair<double, Eigen::Vector3d>> DiffusionScan::volumes() const {
  std::vector<std::pair<double, Eigen::Vector3d>> all(2, {0.0, Eigen::Vector3d::Zero()});
  // A spiral over half of the sphere.
  constexpr int directions = 12;
  for (int i = 0; i < directions; ++i) {
    const double z = (i + 0.5) / directions, around = 2.399963 * i;
    const double radius = std::sqrt(1 - z * z);
    all.emplace_back(1000.0, Eigen::Vector3d(radius * std::cos(around), radius * std::sin(around), z));
  }
  for (size_t v = 2; second_shell && v < 2 + directions; ++v)
    all.emplace_back(2000.0, all[v].second);
  return all;
}

std::optional<Eigen::Vector3d> DiffusionScan::fibre(const Eigen::Vector3d& place_mm) const {
  const Eigen::Vector3d x = axes.transpose() * (place_mm - origin_mm);
  const auto t = depth_at(x);
  if (!t) return std::nullopt;
  return axes * local_fibre(*this, x, *t);
}

Eigen::Matrix3d DiffusionScan::tensor(const Eigen::Vector3d& place_mm) const {
  const auto f = fibre(place_mm);
  if (isotropic || !f) return Eigen::Matrix3d::Identity();
  return across * Eigen::Matrix3d::Identity() + (along - across) * *f * f->transpose();
}

void write_dicom(const DiffusionScan& scan, const std::filesystem::path& folder) {
  const auto volumes = scan.volumes();
  const auto signals = signals_of(scan);
  const Grid grid = grid_of(scan);
  int instance = 0;
  for (size_t v = 0; v < volumes.size(); ++v) {
    if (scan.absent_volumes.contains(static_cast<int>(v))) continue;
    for (int slice = 0; slice < scan.slices; ++slice) {
      ++instance;
      if (scan.missing.contains({static_cast<int>(v), slice})) continue;
      std::vector<Uint16> pixels;
      for (const double signal : signals[v][static_cast<size_t>(slice)])
        pixels.push_back(static_cast<Uint16>(std::lround(16 * signal)));
      DcmFileFormat file;
      DcmDataset& data = *file.getDataset();
      put(data, DCM_SOPClassUID, UID_MRImageStorage);
      put(data, DCM_SOPInstanceUID, fmt::format("1.2.7.{}", instance));
      put(data, DCM_SeriesInstanceUID, "1.2.7");
      put(data, DCM_StudyInstanceUID, "1.2");
      put(data, DCM_Modality, "MR");
      put(data, DCM_Manufacturer, scan.tags == DiffusionTags::siemens ? "SIEMENS" : "GENERIC");
      put(data, DCM_ImageType, "ORIGINAL\\PRIMARY\\M\\ND");
      put(data, DCM_SeriesNumber, "7");
      put(data, DCM_InstanceNumber, std::to_string(instance));
      put(data, DCM_SliceThickness, fmt::format("{}", scan.thickness_mm));
      const Eigen::Vector3d at =
          scan.origin_mm + scan.axes * (grid.first_mm + Eigen::Vector3d(0, 0, slice * scan.thickness_mm));
      put(data, DCM_ImagePositionPatient, fmt::format("{:.6f}\\{:.6f}\\{:.6f}", at.x(), at.y(), at.z()));
      const Eigen::Matrix3d& m = scan.axes;
      put(data, DCM_ImageOrientationPatient,
          fmt::format("{:.8f}\\{:.8f}\\{:.8f}\\{:.8f}\\{:.8f}\\{:.8f}", m(0, 0), m(1, 0), m(2, 0), m(0, 1),
                      m(1, 1), m(2, 1)));
      put(data, DCM_PixelSpacing, fmt::format("{0}\\{0}", scan.pixel_mm));
      put(data, DCM_PhotometricInterpretation, "MONOCHROME2");
      put_encoding(data, scan.tags, volumes[v].first,
                   scan.header_signs.cwiseProduct(scan.header_turn * volumes[v].second));
      for (const auto& [tag, value] : {std::pair(DCM_SamplesPerPixel, 1),
                                       {DCM_Rows, scan.pixels},
                                       {DCM_Columns, scan.pixels},
                                       {DCM_BitsAllocated, 16},
                                       {DCM_BitsStored, 16},
                                       {DCM_HighBit, 15},
                                       {DCM_PixelRepresentation, 0}})
        data.putAndInsertUint16(tag, static_cast<Uint16>(value));
      data.putAndInsertUint16Array(DCM_PixelData, pixels.data(), pixels.size());
      const auto name = folder / fmt::format("im{:03}.dcm", instance);
      if (file.saveFile(name.c_str(), EXS_LittleEndianExplicit).bad())
        throw std::runtime_error("cannot write the image");
    }
  }
}

void write_nifti(const DiffusionScan& scan, const std::filesystem::path& folder) {
  const auto volumes = scan.volumes();
  const auto signals = signals_of(scan);
  const Grid grid = grid_of(scan);
  // https://nifti.nimh.nih.gov: 348 bytes of header, 4 of nothing, then the voxels.
  std::string header(352, '\0');
  const auto set = [&](size_t at, auto value) { std::memcpy(header.data() + at, &value, sizeof value); };
  set(0, int32_t{348});
  for (const auto& [at, value] : {std::pair{40, 4},
                                  {42, scan.pixels},
                                  {44, scan.pixels},
                                  {46, scan.slices},
                                  {48, static_cast<int>(volumes.size())},
                                  {50, 1},
                                  {52, 1},
                                  {54, 1}})
    set(static_cast<size_t>(at), static_cast<int16_t>(value));
  set(70, int16_t{16});  // float
  set(72, int16_t{32});
  for (const auto& [at, value] : {std::pair{76, 1.0},
                                  {80, scan.pixel_mm},
                                  {84, scan.pixel_mm},
                                  {88, scan.thickness_mm},
                                  {92, 1.0},
                                  {108, 352.0},
                                  {112, 1.0}})
    set(static_cast<size_t>(at), static_cast<float>(value));
  header[123] = 2;       // mm
  set(254, int16_t{1});  // sform: scanner
  const Eigen::Matrix3d to_ras = Eigen::Vector3d(-1, -1, 1).asDiagonal();
  const Eigen::Matrix3d axes = to_ras * scan.axes;
  const Eigen::Vector3d origin = to_ras * (scan.origin_mm + scan.axes * grid.first_mm);
  const Eigen::Vector3d step(scan.pixel_mm, scan.pixel_mm, scan.thickness_mm);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 4; ++j)
      set(static_cast<size_t>(280 + 16 * i + 4 * j),
          static_cast<float>(j < 3 ? axes(i, j) * step[j] : origin[i]));
  std::memcpy(header.data() + 344, "n+1", 4);
  std::ofstream image(folder / "dwi.nii", std::ios::binary);
  image << header;
  std::string b_values, rows[3];
  const double flip = axes.determinant() > 0 ? -1 : 1;
  for (size_t v = 0; v < volumes.size(); ++v) {
    const Eigen::Vector3d g = axes.transpose() * to_ras * volumes[v].second;
    b_values += fmt::format("{} ", volumes[v].first);
    for (int i = 0; i < 3; ++i)
      rows[i] += fmt::format("{:.15f} ", i == 0 ? flip * g[i] : g[i]);
    for (const std::vector<double>& slice : signals[v]) {
      for (const double signal : slice) {
        const auto value = static_cast<float>(signal);
        image.write(reinterpret_cast<const char*>(&value), sizeof value);
      }
    }
  }
  std::ofstream(folder / "dwi.bval") << b_values << "\n";
  std::ofstream(folder / "dwi.bvec") << rows[0] << "\n" << rows[1] << "\n" << rows[2] << "\n";
}

}  // namespace diastole::test
