#pragma once
// A study whose data are images: [data] images = "dicom/".

#include "estimator/io/study.hpp"

namespace diastole {

/// Where the study names images: tracks them, writes the tags beside the study as NAME.images-FINGERPRINT.tags.csv and makes these the
/// study's tags. Files with the fingerprint of the same images, pose and tracker are taken as they are. Says on standard error what
/// it does. Throws InputError as `track` does, and if the images do not show where the specimen lies.
void use_images(Study& study);

}  // namespace diastole
