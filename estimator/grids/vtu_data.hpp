#pragma once
// The encodings of numbers in VTK's XML files.

#include <pugixml.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace diastole {

struct VtuEncoding {
  bool wide_header = false;  ///< header_type UInt64, else UInt32
  bool compressed = false;   ///< by zlib
  std::string appended;      ///< what follows the underscore
  bool appended_raw = false;
};

/// The numbers of a DataArray, whatever their type. Throws std::invalid_argument with the problem.
std::vector<double> numbers_of(const pugi::xml_node& array, const VtuEncoding& encoding);

/// Numbers between white space. Throws std::invalid_argument with the first word that is none.
std::vector<double> numbers_of_text(std::string_view text);

}  // namespace diastole
