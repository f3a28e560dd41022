#pragma once
// A large export made of a small one.

#include <cstddef>
#include <filesystem>

namespace diastole {

/// Writes copies of a folder's classic DICOM files until there are `count`, each round of them as series of its own, 10 mm farther along the slice's
/// normal. Throws std::runtime_error if the folder holds none.
void copy_images(const std::filesystem::path& from, const std::filesystem::path& to, size_t count);

}  // namespace diastole
