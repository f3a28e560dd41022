#include "firmware/boards/recording/memory_flash.hpp"

#include <algorithm>
#include <fstream>
#include <utility>

namespace diastole::firmware {

namespace {

char* characters(std::vector<std::uint8_t>& bytes) { return reinterpret_cast<char*>(bytes.data()); }
const char* characters(const std::vector<std::uint8_t>& bytes) {
  return reinterpret_cast<const char*>(bytes.data());
}

}  // namespace

MemoryFlash::MemoryFlash(std::filesystem::path file) : file_(std::move(file)) {
  std::ifstream in(file_, std::ios::binary);
  for (auto& sector : sectors_)
    in.read(characters(sector), kSectorBytes);
}

bool MemoryFlash::erase(std::size_t index) {
  std::ranges::fill(sectors_[index], std::uint8_t{0xFF});
  return keep();
}

bool MemoryFlash::program(std::size_t index, std::size_t offset, std::span<const std::uint8_t> bytes) {
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    std::uint8_t& cell = sectors_[index][offset + i];
    cell = static_cast<std::uint8_t>(cell & bytes[i]);
  }
  return keep();
}

bool MemoryFlash::keep() const {
  if (file_.empty()) return true;
  std::ofstream out(file_, std::ios::binary | std::ios::trunc);
  for (const auto& sector : sectors_)
    out.write(characters(sector), kSectorBytes);
  return out.good();
}

}  // namespace diastole::firmware
