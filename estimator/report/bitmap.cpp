#include "estimator/report/bitmap.hpp"

#include "estimator/io/tracking_file.hpp"

namespace diastole::report {

std::string bitmap(const std::string& grey, int rows, int columns) {
  const auto stride = static_cast<size_t>((columns + 3) / 4 * 4);
  std::string file = "BM";
  const auto put = [&](size_t value, int bytes) {
    for (int i = 0; i < bytes; ++i)
      file += static_cast<char>(static_cast<unsigned char>(value >> (8 * i) & 255U));
  };
  constexpr size_t header = 14 + 40 + 4 * 256;
  put(header + stride * static_cast<size_t>(rows), 4);
  put(0, 4);
  put(header, 4);
  put(40, 4);
  put(static_cast<size_t>(columns), 4);
  put(static_cast<size_t>(rows), 4);
  put(1, 2);
  put(8, 2);
  for (int i = 0; i < 4; ++i)
    put(0, 4);
  put(256, 4);
  put(0, 4);
  for (size_t level = 0; level < 256; ++level)
    put(level << 16U | level << 8U | level, 4);
  for (int row = rows; row-- > 0;) {
    file +=
        grey.substr(static_cast<size_t>(row) * static_cast<size_t>(columns), static_cast<size_t>(columns));
    file.append(stride - static_cast<size_t>(columns), '\0');
  }
  return "data:image/bmp;base64," + base64(file);
}

}  // namespace diastole::report
