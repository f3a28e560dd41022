#include "host/cli/text_file.hpp"

#include <fstream>

#include "host/journal/part_file.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole {

namespace fs = std::filesystem;

void write_text_file(const fs::path& file, std::string_view content) {
  const fs::path temporary = part_file_of(file);
  std::ofstream stream(temporary, std::ios::binary);
  stream.write(content.data(), static_cast<std::streamsize>(content.size()));
  stream.close();
  std::error_code error;
  if (stream) fs::rename(temporary, file, error);
  if (!stream || error) {
    std::error_code ignored;
    fs::remove(temporary, ignored);
    throw HardwareError(file.string(), "cannot be written", "Check the disk's space and your rights there.");
  }
}

}  // namespace diastole
