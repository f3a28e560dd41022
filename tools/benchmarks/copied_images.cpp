#include "tools/benchmarks/copied_images.hpp"

#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dctk.h>
#include <fmt/format.h>

#include <stdexcept>
#include <vector>

namespace diastole {
namespace {

namespace fs = std::filesystem;

std::string text(DcmDataset& data, const DcmTagKey& tag) {
  OFString value;
  data.findAndGetOFStringArray(tag, value);
  return value.c_str();
}

}  // namespace

void copy_images(const fs::path& from, const fs::path& to, size_t count) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(from)) {
    if (entry.is_regular_file()) files.push_back(entry.path());
  }
  if (files.empty()) throw std::runtime_error(from.string() + " holds no files");
  fs::create_directories(to);
  for (size_t written = 0; written < count; ++written) {
    const size_t round = written / files.size();
    DcmFileFormat file;
    if (file.loadFile(files[written % files.size()].c_str()).bad())
      throw std::runtime_error(files[written % files.size()].string() + " is no DICOM file");
    DcmDataset& data = *file.getDataset();
    data.putAndInsertString(DCM_SeriesInstanceUID,
                            fmt::format("{}.{}", text(data, DCM_SeriesInstanceUID), round).c_str());
    data.putAndInsertString(DCM_SOPInstanceUID,
                            fmt::format("{}.{}", text(data, DCM_SOPInstanceUID), round).c_str());
    Float64 x = 0, y = 0, z = 0;
    data.findAndGetFloat64(DCM_ImagePositionPatient, x, 0);
    data.findAndGetFloat64(DCM_ImagePositionPatient, y, 1);
    data.findAndGetFloat64(DCM_ImagePositionPatient, z, 2);
    const double farther_mm = 10.0 * static_cast<double>(round);
    data.putAndInsertString(DCM_ImagePositionPatient,
                            fmt::format("{:.6f}\\{:.6f}\\{:.6f}", x, y, z + farther_mm).c_str());
    if (file.saveFile((to / fmt::format("{:06}.dcm", written)).c_str(), data.getOriginalXfer()).bad())
      throw std::runtime_error("cannot write into " + to.string());
  }
}

}  // namespace diastole
