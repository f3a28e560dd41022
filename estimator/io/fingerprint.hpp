#pragma once
// Eight hexadecimal digits that change with a content: what a kept result was made of.

#include <fmt/format.h>

#include <boost/crc.hpp>
#include <string>
#include <string_view>

namespace diastole {

class Fingerprint {
 public:
  void add(std::string_view content) { crc_.process_bytes(content.data(), content.size()); }
  [[nodiscard]] std::string text() const { return fmt::format("{:08x}", crc_.checksum()); }

 private:
  boost::crc_32_type crc_;
};

inline std::string fingerprint_of(std::string_view content) {
  Fingerprint print;
  print.add(content);
  return print.text();
}

}  // namespace diastole
