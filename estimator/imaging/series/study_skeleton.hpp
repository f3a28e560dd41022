#pragma once
// A study file to complete: what the images show is filled in, the rest is marked.

#include <filesystem>
#include <string>

#include "estimator/imaging/series/image_folder.hpp"

namespace diastole::imaging {

/// Its text, for a file of this name: a ventricle with fibres where diffusion was imaged, else the paper's gel phantom, whose sizes
/// are to be replaced.
std::string study_skeleton(const ImageFolder& folder, const std::filesystem::path& study);

}  // namespace diastole::imaging
