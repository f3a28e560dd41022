#pragma once
// The recording board's settings sectors: memory that behaves as flash does (an erase makes ones, programming only
// zeros), kept in a file if one is named.

#include <array>
#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

namespace diastole::firmware {

class MemoryFlash {
 public:
  static constexpr std::size_t kSectorBytes = 0x4000;

  MemoryFlash() = default;
  /// What the file held, if it is there; it is written anew after every change.
  explicit MemoryFlash(std::filesystem::path file);

  [[nodiscard]] std::span<const std::uint8_t> sector(std::size_t index) const { return sectors_[index]; }
  bool erase(std::size_t index);
  bool program(std::size_t index, std::size_t offset, std::span<const std::uint8_t> bytes);

 private:
  [[nodiscard]] bool keep() const;

  std::filesystem::path file_;
  std::array<std::vector<std::uint8_t>, 2> sectors_{std::vector<std::uint8_t>(kSectorBytes, 0xFF),
                                                    std::vector<std::uint8_t>(kSectorBytes, 0xFF)};
};

}  // namespace diastole::firmware
