#include "tests/estimator/imaging/tagged_ring.hpp"

#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dctk.h>
#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <random>
#include <stdexcept>

namespace diastole::test {
namespace {

constexpr int samples = 4;  // a pixel and direction

/// Brightness of a material whose tags fade: 1 - E (1 + cos phi') / 2 with the dark line at phi = 0.
double faded(double brightness, double left, double phase, bool tagged) {
  return tagged ? brightness * (1 - left * 0.5 * (1 + std::cos(phase))) : brightness;
}

double brightness(const RingScan& scan, int phase, const Eigen::Vector2d& x_mm) {
  const double radius = x_mm.norm();
  const double c = scan.inflation_mm2(phase);
  const double t_s = 1e-3 * scan.time_ms(phase);
  const Eigen::Vector3d place(x_mm.x(), x_mm.y(), 0);
  const auto turns = [&](double along_mm) { return 2 * std::numbers::pi * along_mm / scan.tag_spacing_mm; };
  const double rest = turns(scan.normal().dot(place));
  if (radius * radius < scan.inner_mm * scan.inner_mm + c)
    return faded(650, std::exp(-t_s / 0.08), rest, scan.tagged);
  if (radius * radius < RingScan::outer_mm * RingScan::outer_mm + c)
    return faded(1000, std::exp(-t_s / scan.gel_T1_s), turns(scan.material_mm(phase, place)), scan.tagged);
  return radius < scan.water_mm ? faded(650, std::exp(-t_s / 2.8), rest, scan.tagged) : 0.0;
}

void put(DcmDataset& data, const DcmTagKey& tag, const std::string& value) {
  if (data.putAndInsertString(tag, value.c_str()).bad()) throw std::runtime_error("cannot write " + value);
}

}  // namespace

double RingScan::inflation_mm2(int phase) const {
  const double turn = std::numbers::pi * (time_ms(phase) - 12.0) / (72.0 * phases);
  return most_mm2 * std::pow(std::sin(turn), 2);
}

Eigen::Vector3d RingScan::normal() const {
  const double angle = tag_angle_deg * std::numbers::pi / 180;
  return {std::cos(angle), std::sin(angle), 0};
}

double RingScan::material_mm(int phase, const Eigen::Vector3d& x_mm) const {
  const Eigen::Vector2d x = x_mm.head<2>();
  const double square = x.squaredNorm();
  return std::sqrt(std::max(0.0, 1 - inflation_mm2(phase) / square)) * normal().head<2>().dot(x);
}

std::vector<std::filesystem::path> write_ring(const RingScan& scan, const std::filesystem::path& folder,
                                              const std::string& name) {
  std::mt19937 engine(scan.seed);
  std::normal_distribution<double> noise(0, scan.noise);
  std::vector<std::filesystem::path> files;
  for (int phase = 1; phase <= scan.phases; ++phase) {
    std::vector<double> picture;
    const int rows = static_cast<int>(std::lround(scan.pixels / scan.stretch));
    const double row_mm = scan.pixel_mm * scan.stretch;
    for (int row = 0; row < rows; ++row) {
      for (int column = 0; column < scan.pixels; ++column) {
        double sum = 0;
        for (int i = 0; i < samples * samples; ++i) {
          const Eigen::Vector2d within((i % samples + 0.5) / samples - 0.5,
                                       (i / samples + 0.5) / samples - 0.5);
          const Eigen::Vector3d x = scan.origin_mm + scan.pixel_mm * (column + within.x()) * scan.along_row +
                                    row_mm * (row + within.y()) * scan.along_column;
          sum += brightness(scan, phase, x.head<2>()) / (samples * samples);
        }
        picture.push_back(sum);
      }
    }
    std::vector<Uint16> pixels;
    for (size_t i = 0; i < picture.size(); ++i) {
      const auto shift = static_cast<size_t>(scan.ghost_rows * scan.pixels);
      const double ghost =
          shift > 0 ? scan.ghost_share * picture[(i + picture.size() - shift) % picture.size()] : 0.0;
      const double real = picture[i] + ghost * std::cos(scan.ghost_turn_rad) + noise(engine);
      const double imaginary = ghost * std::sin(scan.ghost_turn_rad) + noise(engine);
      pixels.push_back(static_cast<Uint16>(std::lround(std::hypot(real, imaginary))));
    }
    if (phase == scan.missing_phase) continue;
    DcmFileFormat file;
    DcmDataset& data = *file.getDataset();
    const std::string series_uid = fmt::format("{}.{}", scan.uid, scan.series);
    put(data, DCM_SOPClassUID, UID_MRImageStorage);
    put(data, DCM_SOPInstanceUID, fmt::format("{}.{}", series_uid, phase));
    put(data, DCM_SeriesInstanceUID, series_uid);
    put(data, DCM_StudyInstanceUID, "1.2.3");
    put(data, DCM_Modality, "MR");
    put(data, DCM_Manufacturer, "SIEMENS");
    put(data, DCM_ImageType, "ORIGINAL\\PRIMARY\\M\\ND");
    put(data, DCM_PatientName, "DOE^JANE");
    put(data, DCM_PatientID, "SECRET-17");
    put(data, DCM_SeriesNumber, std::to_string(scan.series));
    put(data, DCM_InstanceNumber, std::to_string(phase));
    put(data, DCM_SliceThickness, "6");
    put(data, DCM_NominalInterval, "1200");
    if (scan.with_times) put(data, DCM_TriggerTime, fmt::format("{}", scan.time_ms(phase)));
    put(data, DCM_ImagePositionPatient,
        fmt::format("{}\\{}\\{}", scan.origin_mm.x(), scan.origin_mm.y(), scan.origin_mm.z()));
    put(data, DCM_ImageOrientationPatient,
        fmt::format("{}\\{}\\{}\\{}\\{}\\{}", scan.along_row.x(), scan.along_row.y(), scan.along_row.z(),
                    scan.along_column.x(), scan.along_column.y(), scan.along_column.z()));
    put(data, DCM_PixelSpacing, fmt::format("{}\\{}", row_mm, scan.pixel_mm));
    put(data, DCM_PhotometricInterpretation, "MONOCHROME2");
    for (const auto& [tag, value] : {std::pair(DCM_SamplesPerPixel, 1),
                                     {DCM_Rows, rows},
                                     {DCM_Columns, scan.pixels},
                                     {DCM_BitsAllocated, 16},
                                     {DCM_BitsStored, 12},
                                     {DCM_HighBit, 11},
                                     {DCM_PixelRepresentation, 0}})
      data.putAndInsertUint16(tag, static_cast<Uint16>(value));
    data.putAndInsertUint16Array(DCM_PixelData, pixels.data(), pixels.size());
    files.push_back(folder / fmt::format("{}{}.dcm", name, phase));
    if (file.saveFile(files.back().c_str(), EXS_LittleEndianExplicit).bad())
      throw std::runtime_error("cannot write the image");
  }
  return files;
}

}  // namespace diastole::test
