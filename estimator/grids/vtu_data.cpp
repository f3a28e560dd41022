#include "estimator/grids/vtu_data.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <cstring>
#include <stdexcept>

namespace diastole {
namespace {

constexpr size_t most_bytes = size_t{1} << 32;
constexpr size_t most_unpacked = 1032;  // of a byte: zlib's best

/// Groups of four characters, each up to three bytes; a block that ends in '=' may be followed by another.
std::string from_base64(std::string_view text) {
  constexpr std::string_view digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string bytes;
  uint32_t group = 0;
  int characters = 0, padding = 0;
  for (const char c : text) {
    if (c <= ' ') continue;
    const size_t digit = c == '=' ? 0 : digits.find(c);
    if (digit == std::string_view::npos) throw std::invalid_argument(fmt::format("\"{}\" is no base64", c));
    padding += c == '=' ? 1 : 0;
    group = group << 6 | static_cast<uint32_t>(digit);
    if (++characters < 4) continue;
    for (int i = 0; i < 3 - padding; ++i)
      bytes.push_back(static_cast<char>(group >> (16 - 8 * i) & 0xff));
    group = 0;
    characters = padding = 0;
  }
  return bytes;
}

/// Lengths at the front of binary data.
class Header {
 public:
  Header(std::string_view bytes, bool wide) : bytes_(bytes), wide_(wide) {}
  size_t next() {
    const size_t width = wide_ ? 8 : 4;
    if (bytes_.size() < at_ + width) throw std::invalid_argument("the data end within their header");
    uint64_t value = 0;
    std::memcpy(&value, bytes_.data() + at_, width);
    at_ += width;
    if (value > most_bytes) throw std::invalid_argument("the header's length is none: another byte order?");
    return value;
  }
  [[nodiscard]] std::string_view rest() const { return bytes_.substr(at_); }

 private:
  std::string_view bytes_;
  bool wide_;
  size_t at_ = 0;
};

std::string unpacked(std::string_view bytes, const VtuEncoding& encoding) {
  Header header(bytes, encoding.wide_header);
  if (!encoding.compressed) {
    const size_t length = header.next();
    if (header.rest().size() < length)
      throw std::invalid_argument("the data are shorter than their header says");
    return std::string(header.rest().substr(0, length));
  }
  const size_t blocks = header.next(), block_size = header.next(), last_size = header.next();
  if (blocks > bytes.size()) throw std::invalid_argument("the header has more blocks than the data");
  std::vector<size_t> sizes;
  for (size_t i = 0; i < blocks; ++i)
    sizes.push_back(header.next());
  std::string_view rest = header.rest();
  std::string whole;
  for (size_t i = 0; i < blocks; ++i) {
    if (rest.size() < sizes[i]) throw std::invalid_argument("the data are shorter than their header says");
    uLongf length = i + 1 == blocks && last_size > 0 ? last_size : block_size;
    if (whole.size() + length > most_bytes) throw std::invalid_argument("the data are too long");
    if (length > most_unpacked * (sizes[i] + 1))
      throw std::invalid_argument("a block claims more than zlib can have packed into it");
    std::string block(length, '\0');
    if (uncompress(reinterpret_cast<Bytef*>(block.data()), &length,
                   reinterpret_cast<const Bytef*>(rest.data()), static_cast<uLong>(sizes[i])) != Z_OK)
      throw std::invalid_argument("a block cannot be unpacked by zlib");
    whole.append(block, 0, length);
    rest.remove_prefix(sizes[i]);
  }
  return whole;
}

template <class Number>
std::vector<double> as_numbers(const std::string& bytes) {
  std::vector<double> values(bytes.size() / sizeof(Number));
  for (size_t i = 0; i < values.size(); ++i) {
    Number value;
    std::memcpy(&value, bytes.data() + i * sizeof(Number), sizeof(Number));
    values[i] = static_cast<double>(value);
  }
  return values;
}

std::vector<double> as_numbers(const std::string& bytes, std::string_view type) {
  if (type == "Float64") return as_numbers<double>(bytes);
  if (type == "Float32") return as_numbers<float>(bytes);
  if (type == "Int64") return as_numbers<int64_t>(bytes);
  if (type == "UInt64") return as_numbers<uint64_t>(bytes);
  if (type == "Int32") return as_numbers<int32_t>(bytes);
  if (type == "UInt32") return as_numbers<uint32_t>(bytes);
  if (type == "Int16") return as_numbers<int16_t>(bytes);
  if (type == "UInt16") return as_numbers<uint16_t>(bytes);
  if (type == "Int8") return as_numbers<int8_t>(bytes);
  if (type == "UInt8") return as_numbers<uint8_t>(bytes);
  throw std::invalid_argument(fmt::format("numbers of type \"{}\" are not known", type));
}

/// Of an array of appended base64 from its offset on: the text up to the next array is not known, so that just enough is decoded.
std::string decoded(std::string_view text, const VtuEncoding& encoding) {
  const size_t width = encoding.wide_header ? 8 : 4;
  const auto encoded = [](size_t bytes) { return (bytes + 2) / 3 * 4; };
  if (!encoding.compressed) {
    const std::string start = from_base64(text.substr(0, encoded(width)));
    return from_base64(text.substr(0, encoded(width + Header(start, encoding.wide_header).next())));
  }
  const std::string start = from_base64(text.substr(0, encoded(3 * width)));
  const size_t blocks = Header(start, encoding.wide_header).next();
  if (blocks > text.size()) throw std::invalid_argument("the header has more blocks than the data");
  const size_t header_text = encoded((3 + blocks) * width);
  const std::string whole = from_base64(text.substr(0, header_text));
  Header header(whole, encoding.wide_header);
  for (int i = 0; i < 3; ++i)
    (void)header.next();
  size_t length = 0;
  for (size_t i = 0; i < blocks; ++i)
    length += header.next();
  return whole + from_base64(text.substr(std::min(text.size(), header_text), encoded(length)));
}

}  // namespace

std::vector<double> numbers_of_text(std::string_view text) {
  std::vector<double> values;
  const char* at = text.data();
  const char* const end = at + text.size();
  while (true) {
    while (at != end && *at <= ' ')
      ++at;
    if (at == end) return values;
    const auto [next, error] = std::from_chars(at, end, values.emplace_back());
    if (error != std::errc{})
      throw std::invalid_argument(
          fmt::format("\"{}\" is no number", std::string(at, std::min(end, at + 12))));
    at = next;
  }
}

std::vector<double> numbers_of(const pugi::xml_node& array, const VtuEncoding& encoding) {
  const std::string_view format = array.attribute("format").as_string("ascii"),
                         type = array.attribute("type").as_string();
  if (format == "ascii") return numbers_of_text(array.text().as_string());
  if (format == "binary") return as_numbers(unpacked(from_base64(array.text().as_string()), encoding), type);
  if (format != "appended")
    throw std::invalid_argument(fmt::format("the format \"{}\" is not known", format));
  const size_t offset = array.attribute("offset").as_ullong();
  if (offset >= encoding.appended.size())
    throw std::invalid_argument("its offset lies beyond the appended data");
  const std::string_view from = std::string_view(encoding.appended).substr(offset);
  return as_numbers(unpacked(encoding.appended_raw ? std::string(from) : decoded(from, encoding), encoding),
                    type);
}

}  // namespace diastole
