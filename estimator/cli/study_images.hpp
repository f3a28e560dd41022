#pragma once
// A study whose data are images: [data] images = "dicom/".

#include <filesystem>
#include <optional>

#include "estimator/io/study.hpp"

namespace diastole {

/// Where the study names images: tracks them, writes the tags beside the study as NAME.images-FINGERPRINT.tags.csv, makes these the
/// study's tags, and returns the record of what was tracked (tracking_file.hpp), which lies beside them. Files with the fingerprint of the
/// same images, pose and tracker are taken as they are. Says on standard error what it does. Throws InputError as `track` does, and if
/// the images do not show where the specimen lies.
std::optional<std::filesystem::path> use_images(Study& study);

}  // namespace diastole
