// Files that a folder of images may hold: whatever the bytes are, headers and pixels are read or refused, and memory stays within what the
// file's own size explains. The DICOM library itself is not instrumented: how it bears its input shows in crashes and in memory only.
//
//   input: the file

#include <cstdio>
#include <cstdlib>
#include <fstream>

#include "estimator/imaging/dicom/dicom_file.hpp"
#include "protocol/contract/input_error.hpp"
#include "tests/host/bench/scratch.hpp"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace diastole;
  static const Scratch scratch("fuzz-dicom");
  const std::filesystem::path file = scratch / "fuzzed.dcm";
  std::ofstream(file, std::ios::binary | std::ios::trunc)
      .write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
  imaging::DicomContent content = imaging::read_headers(file);
  if (content.fault && !content.images.empty()) {
    std::fputs("a faulty file has images\n", stderr);
    std::abort();
  }
  constexpr size_t most_images = 2;
  if (content.images.size() > most_images) content.images.resize(most_images);
  if (content.images.empty()) return 0;
  try {
    for (const imaging::Image& image : imaging::read_pixels(file, content.images)) {
      if (image.rows() != content.images[0].plane.rows || image.cols() != content.images[0].plane.columns)
        std::abort();
    }
  } catch (const InputError&) {
  }
  return 0;
}
