#pragma once
// Images as pictures of 8 bits for a page.

#include <span>
#include <string>

#include "estimator/imaging/dicom/dicom_file.hpp"

namespace diastole::imaging {

/// Brighter than all but one in two hundred pixels of these images; above 0. Images without pixels do not count.
float white_of(std::span<const Image> images);

/// Row by row, base64; `white` and above become 255, 0 and below 0.
std::string grey_picture(const Image& image, float white);

}  // namespace diastole::imaging
