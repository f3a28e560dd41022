#pragma once
// The recording board's settings sectors: memory that behaves as flash does (an erase makes ones, programming only
// zeros), kept in a file if one is named.

#include <algorithm>
#include <array>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <span>
#include <utility>
#include <vector>

namespace diastole::firmware {

class MemoryFlash {
 public:
  static constexpr std::size_t kSectorBytes = 0x4000;

  MemoryFlash() = default;
  /// What the file held, if it is there; it is written anew after every change.
  explicit MemoryFlash(std::filesystem::path file) : file_(std::move(file)) {
    std::ifstream in(file_, std::ios::binary);
    for (auto& sector : sectors_)
      in.read(characters(sector), kSectorBytes);
  }

  [[nodiscard]] std::span<const std::uint8_t> sector(std::size_t index) const { return sectors_[index]; }
  bool erase(std::size_t index) {
    std::ranges::fill(sectors_[index], std::uint8_t{0xFF});
    return keep();
  }
  bool program(std::size_t index, std::size_t offset, std::span<const std::uint8_t> bytes) {
    for (std::size_t i = 0; i < bytes.size(); ++i) {
      std::uint8_t& cell = sectors_[index][offset + i];
      cell = static_cast<std::uint8_t>(cell & bytes[i]);
    }
    return keep();
  }

 private:
  char* characters(std::vector<std::uint8_t>& bytes) { return reinterpret_cast<char*>(bytes.data()); }
  static const char* characters(const std::vector<std::uint8_t>& bytes) {
    return reinterpret_cast<const char*>(bytes.data());
  }

  [[nodiscard]] bool keep() const {
    if (file_.empty()) return true;
    std::ofstream out(file_, std::ios::binary | std::ios::trunc);
    for (const auto& sector : sectors_)
      out.write(characters(sector), kSectorBytes);
    return out.good();
  }

  std::filesystem::path file_;
  std::array<std::vector<std::uint8_t>, 2> sectors_{std::vector<std::uint8_t>(kSectorBytes, 0xFF),
                                                    std::vector<std::uint8_t>(kSectorBytes, 0xFF)};
};

}  // namespace diastole::firmware
