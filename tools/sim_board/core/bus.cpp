#include "tools/sim_board/core/bus.hpp"

#include <cstdio>
#include <utility>

namespace diastole::board_model {
namespace {

std::string hexadecimal(uint32_t value) {
  char text[16];
  std::snprintf(text, sizeof text, "0x%08x", value);
  return text;
}

uint32_t width_mask(uint32_t bytes) { return bytes >= 4 ? 0xffff'ffff : (1U << (8 * bytes)) - 1; }

}  // namespace

void Bus::add(Place place, uint32_t blocks) {
  for (uint32_t block = 0; block < blocks; ++block) {
    by_block_[block_of(place.base) + block] = static_cast<uint32_t>(places_.size());
  }
  places_.push_back(std::move(place));
}

Bus::Place* Bus::find(uint32_t address, const char* action) {
  const uint32_t block = block_of(address);
  const uint32_t index = block < by_block_.size() ? by_block_[block] : no_place;
  if (index == no_place) {
    notes_.add(std::string(action) + " of a register that is not modelled: block at " +
                   hexadecimal(address & ~(block_bytes - 1)),
               clock_.ns(clock_.now()));
    return nullptr;
  }
  Place& place = places_[index];
  if (place.gate.enable_offset != 0 && gates_ != nullptr && !gates_->clocked(place.gate)) {
    notes_.add(std::string(action) + " of " + place.name + " while its clock is off",
               clock_.ns(clock_.now()));
    return nullptr;
  }
  return &place;
}

uint32_t Bus::read(uint32_t address, uint32_t bytes) {
  const Place* place = find(address, "read");
  if (place == nullptr) return 0;
  const uint32_t word = place->device->read((address - place->base) & ~3U);
  return (word >> (8 * (address & 3))) & width_mask(bytes);
}

void Bus::write(uint32_t address, uint32_t value, uint32_t bytes) {
  const Place* place = find(address, "write");
  if (place == nullptr) return;
  const uint32_t shift = 8 * (address & 3);
  place->device->write((address - place->base) & ~3U, value << shift, width_mask(bytes) << shift);
}

void Bus::reset_all() {
  for (const Place& place : places_)
    place.device->reset();
}

void Bus::reset_gated(uint32_t enable_offset, uint32_t bits) {
  for (const Place& place : places_) {
    if (place.gate.enable_offset == enable_offset && (bits >> place.gate.bit & 1) != 0) place.device->reset();
  }
}

}  // namespace diastole::board_model
