#include "tools/sim_scanner/dicom_image.hpp"

#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dctk.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "protocol/contract/input_error.hpp"

namespace diastole::scanner {
namespace {

/// Stored number = (value - intercept) / slope.
struct Storage {
  double slope = 1e-3, intercept = 0;
  double least = 0, most = 4095;
  bool is_signed = false;
  std::string units = {};  ///< RescaleType; none: no rescaling is written
};

Storage storage_of(const ImageLabel& label) {
  if (!label.velocity || !label.velocity->is_velocity) return {};
  const double venc = label.velocity->venc_cm_s;
  switch (label.velocity->maker) {
    case Maker::siemens:
      return {2.0, -4096, 0, 4095, false, "US"};
    case Maker::philips:
      return {2 * venc / 4095, -venc, 0, 4095, false, "cm/s"};
    case Maker::ge:
      return {0.1, 0, -32768, 32767, true, "cm/s"};
  }
  return {};
}

/// What one half turn is in stored values after slope and intercept.
double half_turn_of(const ImageLabel& label) {
  if (!label.velocity || !label.velocity->is_velocity) return 1;
  return label.velocity->maker == Maker::siemens ? 4096 : label.velocity->venc_cm_s;
}

const char* manufacturer_of(const ImageLabel& label) {
  if (!label.velocity) return "Diastole scan";
  switch (label.velocity->maker) {
    case Maker::siemens:
      return "SIEMENS";
    case Maker::philips:
      return "Philips";
    case Maker::ge:
      return "GE";
  }
  return "";
}

/// Pixels as they are stored, row after row; `unit`: what one is in the picture's.
std::vector<Uint16> stored(const Picture& picture, const Storage& storage, double unit) {
  std::vector<Uint16> pixels;
  for (Eigen::Index row = 0; row < picture.rows(); ++row) {
    for (Eigen::Index column = 0; column < picture.cols(); ++column)
      pixels.push_back(static_cast<Uint16>(std::lround(
          std::clamp((static_cast<double>(picture(row, column)) * unit - storage.intercept) / storage.slope,
                     storage.least, storage.most))));
  }
  return pixels;
}

/// How the scanner's maker says what the pixels are.
void put_kind(DcmDataset& data, const ImageLabel& label, const Storage& storage) {
  const auto put = [&](const DcmTagKey& tag, const std::string& value) {
    data.putAndInsertString(tag, value.c_str());
  };
  put(DCM_Manufacturer, manufacturer_of(label));
  // One maker leaves it to the pixels to show which image is which.
  const bool is_unstated = label.velocity && label.velocity->maker == Maker::ge;
  put(DCM_ImageType, is_unstated             ? "ORIGINAL\\PRIMARY\\OTHER"
                     : storage.units.empty() ? "ORIGINAL\\PRIMARY\\M"
                                             : "ORIGINAL\\PRIMARY\\P");
  if (label.velocity && label.velocity->says_venc && label.velocity->maker == Maker::siemens)
    put(DCM_SequenceName, fmt::format("*fl2d1_v{:.0f}in", label.velocity->venc_cm_s));
  if (!storage.units.empty()) {
    put(DCM_RescaleIntercept, fmt::format("{:.8g}", storage.intercept));
    put(DCM_RescaleSlope, fmt::format("{:.10g}", storage.slope));
    put(DCM_RescaleType, storage.units);
  }
}

}  // namespace

void write_dicom(const std::filesystem::path& path, const Picture& picture, const ImageLabel& label) {
  DcmFileFormat file;
  DcmDataset& data = *file.getDataset();
  const auto put = [&](const DcmTagKey& tag, const std::string& value) {
    data.putAndInsertString(tag, value.c_str());
  };
  const auto triple = [](const Eigen::Vector3d& v) {
    return fmt::format("{:.6f}\\{:.6f}\\{:.6f}", v.x(), v.y(), v.z());
  };
  put(DCM_SOPClassUID, UID_MRImageStorage);
  put(DCM_SOPInstanceUID, label.image_uid);
  put(DCM_StudyInstanceUID, label.study_uid);
  put(DCM_SeriesInstanceUID, label.series_uid);
  put(DCM_Modality, "MR");
  const Storage storage = storage_of(label);
  put_kind(data, label, storage);
  put(DCM_ScanningSequence, "GR");
  put(DCM_PatientName, "");
  put(DCM_PatientID, "");
  put(DCM_SeriesNumber, std::to_string(label.series_number));
  put(DCM_InstanceNumber, std::to_string(label.instance));
  put(DCM_SliceThickness, fmt::format("{:.4g}", label.thickness_mm));
  if (label.diffusion) {
    data.putAndInsertFloat64(DCM_DiffusionBValue, label.diffusion->b_s_mm2);
    const Eigen::Vector3d& g = label.diffusion->direction;
    if (label.diffusion->b_s_mm2 > 0)
      data.putAndInsertFloat64Array(DCM_DiffusionGradientOrientation, g.data(), 3);
  } else {
    put(DCM_TriggerTime, fmt::format("{:.4f}", label.trigger_ms));
    put(DCM_NominalInterval, fmt::format("{:.0f}", label.interval_ms));
  }
  put(DCM_ImagePositionPatient, triple(label.first_mm));
  put(DCM_ImageOrientationPatient, triple(label.along_row) + "\\" + triple(label.along_column));
  put(DCM_PixelSpacing, fmt::format("{:.6f}\\{:.6f}", label.pixel_mm, label.pixel_mm));
  put(DCM_PhotometricInterpretation, "MONOCHROME2");
  const std::vector<std::pair<DcmTagKey, Eigen::Index>> numbers = {
      {DCM_SamplesPerPixel, 1},
      {DCM_Rows, picture.rows()},
      {DCM_Columns, picture.cols()},
      {DCM_BitsAllocated, 16},
      {DCM_BitsStored, storage.is_signed ? 16 : 12},
      {DCM_HighBit, storage.is_signed ? 15 : 11},
      {DCM_PixelRepresentation, storage.is_signed ? 1 : 0}};
  for (const auto& [tag, value] : numbers)
    data.putAndInsertUint16(tag, static_cast<Uint16>(value));
  const std::vector<Uint16> pixels = stored(picture, storage, half_turn_of(label));
  data.putAndInsertUint16Array(DCM_PixelData, pixels.data(), pixels.size());
  const OFCondition saved = file.saveFile(path.c_str(), EXS_LittleEndianExplicit);
  if (saved.bad())
    throw InputError({path.string(), "", fmt::format("cannot be written: {}", saved.text()),
                      "Check the folder and the space on its disk."});
}

}  // namespace diastole::scanner
