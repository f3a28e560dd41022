#include "host/flash/update_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <span>

#include "protocol/contract/bounded_file.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/signing/signing_key.hpp"
#include "protocol/wire/update_file.hpp"

namespace diastole {
namespace {

using Bytes = std::span<const uint8_t>;

[[noreturn]] void refuse(
    const std::string& file, std::string place, std::string problem,
    std::string remedy = "Build it again (cmake --build --preset firmware), or fetch it again.") {
  throw InputError({file, std::move(place), std::move(problem), std::move(remedy)});
}

void check_frame(const std::string& file, Bytes bytes) {
  using wire::detail::get_little;
  if (bytes.size() < wire::kUpdateFileHeadBytes ||
      !std::equal(wire::kUpdateFileMagic.begin(), wire::kUpdateFileMagic.end(), bytes.begin())) {
    refuse(file, "offset 0", "is no update file: it does not begin with \"DIASTOLE\"",
           "Give build/firmware/bin/diastole-stm32f405.image; .bin, .hex and .elf are for SWD tools.");
  }
  if (const auto version = get_little<uint16_t>(bytes.subspan(8)); version != wire::kUpdateFileVersion) {
    refuse(file, "offset 8",
           fmt::format("is an update file of version {}, and this program knows {}", version,
                       wire::kUpdateFileVersion),
           version < wire::kUpdateFileVersion ? "Build it again (cmake --build --preset firmware)."
                                              : "Update the host programs.");
  }
  const auto size = get_little<uint32_t>(bytes.subspan(12));
  if (size != bytes.size() || size < wire::kUpdateFileHeadBytes + sizeof(wire::Digest)) {
    refuse(file, "offset 12", fmt::format("should have {} bytes and has {}", size, bytes.size()));
  }
  const Bytes before = bytes.first(bytes.size() - sizeof(wire::Digest));
  if (!std::ranges::equal(wire::sha256(before), bytes.last(sizeof(wire::Digest)))) {
    refuse(file, fmt::format("offset {}", before.size()), "is damaged: its SHA-256 does not match");
  }
}

/// Takes one image off the front of `rest`.
SlotImage take_image(const std::string& file, Bytes& rest, size_t index) {
  const std::string place = fmt::format("image {}", index);
  if (rest.size() < wire::kImageHeaderBytes) refuse(file, place, "is missing");
  const auto header = wire::decode_image_header(rest.first<wire::kImageHeaderBytes>());
  if (!header) refuse(file, place, "has a damaged header");
  rest = rest.subspan(wire::kImageHeaderBytes);
  if (rest.size() < wire::kImageSignatureBytes) refuse(file, place, "has no signature block");
  const auto signature = wire::decode_image_signature(rest.first<wire::kImageSignatureBytes>());
  if (!signature) refuse(file, place, "has a damaged signature block");
  rest = rest.subspan(wire::kImageSignatureBytes);
  if (rest.size() < header->code_bytes) {
    refuse(file, place,
           fmt::format("should have {} bytes of code and has {}", header->code_bytes, rest.size()));
  }
  const Bytes code = rest.first(header->code_bytes);
  rest = rest.subspan(header->code_bytes);
  if (wire::digest_of(*header, code) != header->sha256) {
    refuse(file, place, "is damaged: its SHA-256 does not match");
  }
  return {*header, *signature, {code.begin(), code.end()}};
}

std::vector<uint8_t> bytes_of(const UpdateFile& update) {
  std::vector<uint8_t> bytes;
  const auto add = [&bytes](const auto& more) { bytes.insert(bytes.end(), more.begin(), more.end()); };
  std::array<uint8_t, wire::kUpdateFileHeadBytes> head{};
  std::ranges::copy(wire::kUpdateFileMagic, head.begin());
  size_t size = head.size() + sizeof(wire::Digest);
  for (const SlotImage& image : update.images)
    size += wire::kSignedHeaderBytes + image.code.size();
  wire::detail::put_little(std::span(head).subspan(8, 2), wire::kUpdateFileVersion);
  wire::detail::put_little(std::span(head).subspan(10, 2), static_cast<uint16_t>(update.images.size()));
  wire::detail::put_little(std::span(head).subspan(12, 4), static_cast<uint32_t>(size));
  add(head);
  for (const SlotImage& image : update.images) {
    add(wire::encode(image.header));
    add(wire::encode(image.signature));
    add(image.code);
  }
  add(wire::sha256(bytes));
  return bytes;
}

}  // namespace

UpdateFile parse_update_file(const std::string& file, const std::vector<uint8_t>& bytes) {
  check_frame(file, bytes);
  UpdateFile update{file, {}, 0, 0, {}};
  const auto count = wire::detail::get_little<uint16_t>(std::span(bytes).subspan(10));
  Bytes rest = Bytes(bytes).subspan(wire::kUpdateFileHeadBytes);
  rest = rest.first(rest.size() - sizeof(wire::Digest));
  for (size_t i = 0; i < count; ++i)
    update.images.push_back(take_image(file, rest, i));
  if (update.images.empty() || !rest.empty())
    refuse(file, "offset 10", "does not hold the images it tells of");
  const wire::ImageHeader& first = update.images.front().header;
  update.version = first.version;
  update.board_id = first.board_id;
  update.build_id = first.build_id;
  for (const SlotImage& image : update.images) {
    if (image.header.version != update.version || image.header.board_id != update.board_id ||
        image.header.build_id != update.build_id) {
      refuse(file, "images", "are not of one build");
    }
  }
  return update;
}

UpdateFile read_update_file(const std::string& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream || std::filesystem::is_directory(file)) {
    refuse(file, "", "cannot be read",
           "Give the update file, such as build/firmware/bin/diastole-stm32f405.image (cmake --preset "
           "firmware and cmake --build --preset firmware make it).");
  }
  // Two images of 128 KB each, with their headers.
  const std::string content = read_bounded_file(file, megabyte);
  return parse_update_file(file, {content.begin(), content.end()});
}

UpdateFile sign_update_file(const std::string& file, const std::string& key_file,
                            std::optional<uint32_t> counter) {
  UpdateFile update = read_update_file(file);
  signing::SecretKey key{};
  try {
    key = signing::read_key_file(key_file);
  } catch (const std::runtime_error& problem) {
    throw InputError({"", "--sign", problem.what(), ""});
  }
  for (SlotImage& image : update.images) {
    wire::ImageSignature& signature = image.signature;
    signature.counter = counter.value_or(signature.counter);
    signature.signature =
        signing::sign(key, wire::signed_bytes(wire::encode(image.header), signature.counter));
  }
  const std::vector<uint8_t> bytes = bytes_of(update);
  const std::string part = file + ".part";
  std::ofstream stream(part, std::ios::binary | std::ios::trunc);
  stream.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  std::error_code failed;
  if (stream.flush()) std::filesystem::rename(part, file, failed);
  if (stream && !failed) return update;
  std::filesystem::remove(part, failed);
  refuse(file, "", "cannot be written", "Sign a copy in a folder of yours.");
}

std::string in_words(wire::FirmwareVersion version) {
  return fmt::format("{}.{}.{}", version.major, version.minor, version.patch);
}

}  // namespace diastole
