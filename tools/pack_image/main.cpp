// pack_image: makes of the application's two links what is flashed. The firmware's build runs it; it is compiled
// for this machine by that build itself and uses nothing but protocol/wire.
//
//   pack_image VERSION BOARD_ID ADDRESS_A CODE_A ADDRESS_B CODE_B OUT KEY COUNTER
//
// writes OUT.image (protocol/wire/update_file.hpp), OUT.header (slot A's header area) and OUT.record (the record
// that slot A is confirmed, for images that come by SWD), signed with the key in file KEY; KEY `none` does not sign.
//
//   pack_image --public-key KEY OUT [--make]
//
// writes the 32 bytes that the bootloader checks signatures with, all 0xFF for `none`; --make makes KEY if there is none.

#include <charconv>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "firmware/boot/boot_records.hpp"
#include "protocol/signing/signing_key.hpp"
#include "protocol/wire/image_signature.hpp"
#include "protocol/wire/update_file.hpp"

namespace {

using namespace diastole;
using Bytes = std::vector<std::uint8_t>;

Bytes read(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  Bytes bytes{std::istreambuf_iterator<char>(file), {}};
  if (bytes.empty() || bytes.size() % 4 != 0)
    throw std::runtime_error(path + ": is missing, empty, or not whole words");
  return bytes;
}

void write(const std::string& path, const Bytes& bytes) {
  std::ofstream file(path, std::ios::binary | std::ios::trunc);
  file.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  if (!file.flush()) throw std::runtime_error(path + ": cannot be written");
}

template <class Range>
void add(Bytes& bytes, const Range& more) {
  bytes.insert(bytes.end(), more.begin(), more.end());
}

template <class Integer>
void add_number(Bytes& bytes, Integer value) {
  std::array<std::uint8_t, sizeof(Integer)> little{};
  wire::detail::put_little(little, value);
  add(bytes, little);
}

wire::FirmwareVersion parse_version(const std::string& text) {
  unsigned major = 0, minor = 0, patch = 0;
  if (std::sscanf(text.c_str(), "%u.%u.%u", &major, &minor, &patch) != 3 || major > 255 || minor > 255 ||
      patch > 255)
    throw std::runtime_error(text + " is no version (1.2.3)");
  return {static_cast<std::uint8_t>(major), static_cast<std::uint8_t>(minor),
          static_cast<std::uint8_t>(patch)};
}

/// Digits only: of a counter that is misread upwards no later image would ever be taken.
std::uint32_t parse_counter(std::string_view text) {
  std::uint32_t counter = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), counter);
  if (error != std::errc{} || end != text.data() + text.size())
    throw std::runtime_error(std::string(text) + " is no rollback counter (0, 1, 2, ... 4294967295)");
  return counter;
}

/// The first half of a hash over both codes, so that the two images of one build have the same.
std::uint64_t build_id(const Bytes& code_a, const Bytes& code_b) {
  wire::Sha256 hash;
  hash.add(code_a);
  hash.add(code_b);
  const wire::Digest digest = hash.digest();
  return wire::detail::get_little<std::uint64_t>(digest);
}

wire::ImageHeader make_header(wire::ImageHeader header, const char* address, const Bytes& code) {
  header.link_address = static_cast<std::uint32_t>(std::strtoul(address, nullptr, 0));
  header.code_bytes = static_cast<std::uint32_t>(code.size());
  header.sha256 = wire::digest_of(header, code);
  return header;
}

/// Header and signature, as they stand before the code in file and slot.
Bytes signed_header(const wire::ImageHeader& header, const std::string& key, std::uint32_t counter) {
  Bytes bytes;
  add(bytes, wire::encode(header));
  wire::ImageSignature signature{.counter = counter};
  if (key != "none")
    signature.signature =
        signing::sign(signing::read_key_file(key), wire::signed_bytes(wire::encode(header), counter));
  add(bytes, wire::encode(signature));
  return bytes;
}

Bytes update_file(const Bytes& header_a, const Bytes& code_a, const Bytes& header_b, const Bytes& code_b) {
  Bytes file;
  add(file, wire::kUpdateFileMagic);
  add_number(file, wire::kUpdateFileVersion);
  add_number(file, wire::kUpdateFileImages);
  const std::size_t size = wire::kUpdateFileHeadBytes + header_a.size() + code_a.size() + header_b.size() +
                           code_b.size() + sizeof(wire::Digest);
  add_number(file, static_cast<std::uint32_t>(size));
  add(file, header_a);
  add(file, code_a);
  add(file, header_b);
  add(file, code_b);
  add(file, wire::sha256(file));
  return file;
}

void pack(char** argument) {
  const Bytes code_a = read(argument[4]), code_b = read(argument[6]);
  wire::ImageHeader common;
  common.version = parse_version(argument[1]);
  common.board_id = static_cast<std::uint16_t>(std::strtoul(argument[2], nullptr, 0));
  common.build_id = build_id(code_a, code_b);
  const wire::ImageHeader a = make_header(common, argument[3], code_a);
  const wire::ImageHeader b = make_header(common, argument[5], code_b);
  const std::string out = argument[7], key = argument[8];
  const std::uint32_t counter = parse_counter(argument[9]);
  Bytes area = signed_header(a, key, counter);
  write(out + ".image", update_file(area, code_a, signed_header(b, key, counter), code_b));
  area.resize(wire::kImageHeaderArea, 0xFF);
  write(out + ".header", area);
  Bytes record;
  add(record, boot::encode({boot::BootEvent::confirmed, wire::ImageSlot::a, boot::tag_of(a)}));
  write(out + ".record", record);
}

void write_public_key(const std::string& key, const std::string& out, bool make) {
  Bytes bytes(sizeof(signing::PublicKey), 0xFF);
  if (key != "none") {
    const bool missing = !std::ifstream(key);
    const signing::SecretKey secret =
        missing && make ? signing::make_key_file(key) : signing::read_key_file(key);
    if (missing)
      std::printf(
          "A key to sign firmware with was made: %s. Keep a copy: a controller takes firmware of this key "
          "only.\n",
          key.c_str());
    const signing::PublicKey open = signing::public_key_of(secret);
    bytes.assign(open.begin(), open.end());
  }
  write(out, bytes);
}

}  // namespace

int main(int count, char** argument) {
  const std::string first = count > 1 ? argument[1] : "";
  try {
    if (count == 10)
      pack(argument);
    else if ((count == 4 || count == 5) && first == "--public-key")
      write_public_key(argument[2], argument[3], count == 5);
    else
      throw std::runtime_error(
          "usage: pack_image VERSION BOARD_ID ADDRESS_A CODE_A ADDRESS_B CODE_B OUT KEY COUNTER");
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "pack_image: %s\n", error.what());
    return 2;
  }
}
