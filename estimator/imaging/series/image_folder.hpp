#pragma once
// A scanner's export as it lies on the disk: any order, any file names, several studies' worth of series.

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "estimator/imaging/series/image_series.hpp"
#include "estimator/io/finding.hpp"

namespace diastole::imaging {

struct ImageFolder {
  std::filesystem::path folder;
  std::vector<std::filesystem::path> files;  ///< all that are in it
  std::vector<ImageOfFolder> images;
  std::vector<ImageSeries> series;  ///< by series number
  /// An error means that the images are not what they must be; `where` names the file, relative to the folder.
  std::vector<Finding> problems;

  /// The pixels of these images, in this order. Throws InputError (file, frame) for what cannot be decoded.
  [[nodiscard]] std::vector<Image> pixels(const std::vector<size_t>& chosen) const;
  [[nodiscard]] std::string file_name(size_t image) const;  ///< relative to the folder
};

/// All files in a folder and in those within it, in order of their paths. Throws InputError if there is no such folder, or one of
/// them cannot be read.
std::vector<std::filesystem::path> files_below(const std::filesystem::path& folder);

/// FOLDER with this ending, beside the folder: where what a person says about it stands unless another file is named.
inline std::filesystem::path beside(const std::filesystem::path& folder, std::string_view ending) {
  std::filesystem::path whole = std::filesystem::absolute(folder).lexically_normal();
  if (!whole.has_filename()) whole = whole.parent_path();
  return whole.parent_path() / (whole.filename().string() + std::string(ending));
}

using Progress = std::function<void(size_t done, size_t all)>;

/// Reads every header below `folder` and the pixels that the kinds need: one or two images a slice, all of a tagged cine. Throws InputError if there is no
/// such folder, or no file in it that is DICOM.
ImageFolder read_image_folder(const std::filesystem::path& folder, const Progress& progress = {});

/// Of all tagged series of a folder together.
PhaseTimes tagged_phases(const ImageFolder& folder);

/// Of every slice and direction with tags, as the first phase shows them.
std::vector<double> tag_spacings_mm(const ImageFolder& folder);
/// Gradients err by a few per cent, and no protocol offers spacings that are nearer than that: within 5 %.
bool is_tag_spacing(double seen_mm, double stated_mm);

/// Throws the first error of `problems` as an InputError that says how many there are.
void require_sound(const ImageFolder& folder);

}  // namespace diastole::imaging
