#include "tools/sim_scanner/dicom_image.hpp"

#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dctk.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "protocol/contract/input_error.hpp"

namespace diastole::scanner {

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
  put(DCM_Manufacturer, "Diastole scan");
  put(DCM_ImageType, "ORIGINAL\\PRIMARY\\M");
  put(DCM_ScanningSequence, "GR");
  put(DCM_PatientName, "");
  put(DCM_PatientID, "");
  put(DCM_SeriesNumber, std::to_string(label.series_number));
  put(DCM_InstanceNumber, std::to_string(label.instance));
  put(DCM_SliceThickness, fmt::format("{:.4g}", label.thickness_mm));
  put(DCM_TriggerTime, fmt::format("{:.4f}", label.trigger_ms));
  put(DCM_NominalInterval, fmt::format("{:.0f}", label.interval_ms));
  put(DCM_ImagePositionPatient, triple(label.first_mm));
  put(DCM_ImageOrientationPatient, triple(label.along_row) + "\\" + triple(label.along_column));
  put(DCM_PixelSpacing, fmt::format("{:.6f}\\{:.6f}", label.pixel_mm, label.pixel_mm));
  put(DCM_PhotometricInterpretation, "MONOCHROME2");
  const std::vector<std::pair<DcmTagKey, Eigen::Index>> numbers = {
      {DCM_SamplesPerPixel, 1},    {DCM_Rows, picture.rows()}, {DCM_Columns, picture.cols()},
      {DCM_BitsAllocated, 16},     {DCM_BitsStored, 12},       {DCM_HighBit, 11},
      {DCM_PixelRepresentation, 0}};
  for (const auto& [tag, value] : numbers)
    data.putAndInsertUint16(tag, static_cast<Uint16>(value));
  std::vector<Uint16> pixels;
  for (Eigen::Index row = 0; row < picture.rows(); ++row) {
    for (Eigen::Index column = 0; column < picture.cols(); ++column)
      pixels.push_back(static_cast<Uint16>(
          std::lround(std::clamp(1000 * static_cast<double>(picture(row, column)), 0.0, 4095.0))));
  }
  data.putAndInsertUint16Array(DCM_PixelData, pixels.data(), pixels.size());
  const OFCondition saved = file.saveFile(path.c_str(), EXS_LittleEndianExplicit);
  if (saved.bad())
    throw InputError({path.string(), "", fmt::format("cannot be written: {}", saved.text()),
                      "Check the folder and the space on its disk."});
}

}  // namespace diastole::scanner
