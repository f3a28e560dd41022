#pragma once
// One DICOM file of a scanner's export: its images' geometry, timing and encoding (classic and enhanced multi-frame MR),
// and their pixels. Names, identities and free text of the file are never read.

#include <Eigen/Dense>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "estimator/imaging/dicom/slice_plane.hpp"

namespace diastole::imaging {

using Image = Eigen::ArrayXXf;  ///< rows x columns, after the rescale slope and intercept

/// What the header says the pixels are; the pixels themselves have the last word (estimator/imaging/series/image_folder.hpp).
enum class Component { unstated, magnitude, phase };

struct VelocityEncoding {
  double venc_cm_s;
  std::string source;  ///< "(0018,9197)", "SequenceName", "GE (0019,10cc)"
};

struct DiffusionEncoding {
  double b_s_mm2;                            ///< the trace of the b-matrix where the header has nothing else
  std::optional<Eigen::Vector3d> direction;  ///< unit, patient axes
  /// s/mm², patient axes: (0018,9602) to (0018,9607), or Siemens (0019,1027). Holds what imaging gradients add.
  std::optional<Eigen::Matrix3d> b_matrix;

  /// The b-matrix, or b g gᵀ; zero for b = 0; nothing if b > 0 and no direction is known, as of trace images.
  [[nodiscard]] std::optional<Eigen::Matrix3d> weighting() const;
};

/// One image, which is one frame of a file.
struct ImageHeader {
  int frame = 0;  ///< in its file, from 0
  std::string series_uid;
  std::string instance_uid;
  int series_number = 0;
  int instance = 0;
  SlicePlane plane;
  std::optional<double> trigger_ms;     ///< (0018,1060), or (0020,9153) of an enhanced image
  std::optional<double> interval_ms;    ///< the cycle: (0018,1062), or (0020,9251)
  std::optional<int> phases_announced;  ///< (0018,1090)
  Component component = Component::unstated;
  bool says_tagged = false;  ///< (0018,9028)
  std::optional<VelocityEncoding> velocity;
  std::optional<DiffusionEncoding> diffusion;
  double slope = 1.0;
  double intercept = 0.0;
  std::string rescale_units;  ///< (0028,1054): "cm/s", "US"; empty where it is absent
  std::string vendor;         ///< "Siemens", "GE", "Philips", "Canon", or "unknown"
};

/// What is wrong with a file as a whole, in the words of an InputFault.
struct FileFault {
  enum class Kind { foreign, not_mr, truncated, unusable };
  Kind kind;
  std::string place;  ///< "(7fe0,0010)"; may be empty
  std::string problem;
  std::string remedy;
};

struct DicomContent {
  std::vector<ImageHeader> images;
  std::optional<FileFault> fault;  ///< then there are no images
};

/// By its name a DICOM file; README.txt, .DS_Store and the like are none, nor are the nameless ones that scanners write.
bool claims_to_be_dicom(const std::filesystem::path& file);

/// Never throws for what a file holds. Memory is bounded by the file's size: values longer than 4 kB stay in the file, and a
/// length beyond its end is a fault.
DicomContent read_headers(const std::filesystem::path& file);

/// The pixels of these images, all of `file` and in the order of their frames; native, RLE and JPEG (lossless and not). Throws InputError, naming file and frame, if they
/// cannot be decoded.
std::vector<Image> read_pixels(const std::filesystem::path& file, const std::vector<ImageHeader>& images);

}  // namespace diastole::imaging
