#include "estimator/grids/gmsh_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>
#include <unordered_map>
#include <utility>

#include "estimator/io/whole_file.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/contract/text.hpp"

namespace diastole {
namespace {

/// Words of the text, one after the other, with the line that they stand in.
class Words {
 public:
  Words(std::string text, std::string file) : text_(std::move(text)), file_(std::move(file)) {}

  [[nodiscard]] bool ended() {
    skip();
    return at_ == text_.size();
  }
  std::string_view word() {
    if (ended()) fail("the file ends too early");
    const size_t from = at_;
    if (text_[at_] == '"') {
      at_ = text_.find('"', at_ + 1);
      if (at_ == std::string::npos) fail("a quoted name does not end");
      ++at_;
      return std::string_view(text_).substr(from + 1, at_ - from - 2);
    }
    while (at_ < text_.size() && text_[at_] > ' ')
      ++at_;
    return std::string_view(text_).substr(from, at_ - from);
  }
  template <class Number>
  Number number() {
    const std::string_view text = word();
    const auto value = parse_number<Number>(text);
    if (!value) fail(fmt::format("\"{}\" is no number", text));
    return *value;
  }
  /// A count of things that each take two characters at least.
  size_t count() {
    const auto value = number<size_t>();
    if (value > text_.size()) fail(fmt::format("{} are more than the file can hold", value));
    return value;
  }
  void skip_past(std::string_view end) {
    while (word() != end) {
    }
  }
  [[noreturn]] void fail(std::string problem,
                         std::string remedy = "Export it again, as ASCII in version 2.2 or 4.1.") const {
    const auto line =
        1 + std::count(text_.begin(),
                       text_.begin() + static_cast<std::ptrdiff_t>(std::min(at_, text_.size())), '\n');
    throw InputError({file_, fmt::format("line {}", line), std::move(problem), std::move(remedy)});
  }

 private:
  void skip() {
    while (at_ < text_.size() && text_[at_] <= ' ')
      ++at_;
  }
  std::string text_, file_;
  size_t at_ = 0;
};

class GmshReader {
 public:
  explicit GmshReader(const std::string& path) : words_(read_whole_file(path), path) {}

  FieldGrid read() {
    while (!words_.ended()) {
      const std::string section(words_.word());
      if (section == "$MeshFormat")
        read_format();
      else if (version_ == 0)
        words_.fail("does not begin with $MeshFormat", "Give a Gmsh mesh.");
      else if (section == "$PhysicalNames")
        read_names();
      else if (section == "$Entities")
        read_entities();
      else if (section == "$Nodes")
        version_ == 2 ? read_nodes_2() : read_nodes_4();
      else if (section == "$Elements")
        version_ == 2 ? read_elements_2() : read_elements_4();
      else if (section == "$NodeData")
        read_node_data();
      if (section.starts_with("$")) words_.skip_past("$End" + section.substr(1));
    }
    if (!physical_.empty()) grid_.cell_data.push_back({"physical", 1, std::move(physical_)});
    if (grid_.steps.empty()) grid_.steps.emplace_back();
    return std::move(grid_);
  }

 private:
  void read_format() {
    const std::string version(words_.word());
    if (version != "2.2" && version != "4.1")
      words_.fail(fmt::format("is of version {}", version),
                  "Export it from Gmsh as version 2.2 or 4.1, ASCII.");
    if (words_.number<int>() != 0) words_.fail("is binary", "Export it from Gmsh as ASCII.");
    version_ = version[0] - '0';
  }
  void read_names() {
    for (size_t left = words_.count(); left > 0; --left) {
      (void)words_.number<int>();
      const auto number = words_.number<int>();
      grid_.tag_names[std::string(words_.word())] = number;
    }
  }
  void read_entities() {
    std::array<size_t, 4> counts;
    for (size_t& count : counts)
      count = words_.count();
    for (int dimension = 0; dimension < 4; ++dimension) {
      for (size_t left = counts[static_cast<size_t>(dimension)]; left > 0; --left) {
        const auto tag = words_.number<int>();
        for (int i = dimension == 0 ? 3 : 6; i > 0; --i)
          (void)words_.number<double>();
        for (size_t i = words_.count(); i > 0; --i)
          physical_of_.try_emplace({dimension, tag}, words_.number<int>());
        if (dimension == 0) continue;
        for (size_t i = words_.count(); i > 0; --i)
          (void)words_.number<int>();
      }
    }
  }
  void add_place() {
    for (int i = 0; i < 3; ++i)
      grid_.points.push_back(words_.number<double>());
  }
  void number_node(size_t tag) {
    if (!node_of_.try_emplace(tag, node_of_.size()).second)
      words_.fail(fmt::format("node {} stands twice", tag));
  }
  void read_nodes_2() {
    for (size_t left = words_.count(); left > 0; --left) {
      number_node(words_.number<size_t>());
      add_place();
    }
  }
  void read_nodes_4() {
    const size_t blocks = words_.count();
    for (int i = 0; i < 3; ++i)
      (void)words_.number<size_t>();
    for (size_t block = 0; block < blocks; ++block) {
      (void)words_.number<int>();
      (void)words_.number<int>();
      if (words_.number<int>() != 0)
        words_.fail("has parametric nodes", "Export it without parametric coordinates.");
      const size_t nodes = words_.count();
      for (size_t i = 0; i < nodes; ++i)
        number_node(words_.number<size_t>());
      for (size_t i = 0; i < nodes; ++i)
        add_place();
    }
  }
  size_t node(size_t tag) {
    const auto found = node_of_.find(tag);
    if (found == node_of_.end()) words_.fail(fmt::format("names node {}, which does not exist", tag));
    return found->second;
  }
  void add_element(int type, int physical) {
    const auto kind = std::ranges::find(cell_kinds(), type, &CellKind::gmsh);
    if (kind == cell_kinds().end())
      words_.fail(fmt::format("elements of type {} are not known", type), "Export elements of order 1 or 2.");
    GridCell cell{kind->shape, {}};
    for (size_t i = 0; i < kind->points; ++i) {
      const size_t point = node(words_.number<size_t>());
      if (i < corner_count(kind->shape)) cell.points.push_back(point);
    }
    grid_.cells.push_back(std::move(cell));
    physical_.push_back(physical);
  }
  void read_elements_2() {
    for (size_t left = words_.count(); left > 0; --left) {
      (void)words_.number<size_t>();
      const auto type = words_.number<int>();
      const size_t tags = words_.count();
      int physical = 0;
      for (size_t i = 0; i < tags; ++i) {
        const auto tag = words_.number<int>();
        if (i == 0) physical = tag;
      }
      add_element(type, physical);
    }
  }
  void read_elements_4() {
    const size_t blocks = words_.count();
    for (int i = 0; i < 3; ++i)
      (void)words_.number<size_t>();
    for (size_t block = 0; block < blocks; ++block) {
      const auto dimension = words_.number<int>();
      const auto entity = words_.number<int>();
      const auto type = words_.number<int>();
      const auto physical = physical_of_.find({dimension, entity});
      for (size_t left = words_.count(); left > 0; --left) {
        (void)words_.number<size_t>();
        add_element(type, physical == physical_of_.end() ? 0 : physical->second);
      }
    }
  }
  /// Strings: the name first; reals: the time; integers: the step, the components, the number of values.
  void read_node_data() {
    std::string name = "field";
    for (size_t i = 0, strings = words_.count(); i < strings; ++i) {
      const std::string text(words_.word());
      if (i == 0) name = text;
    }
    double time_s = 0.0;
    for (size_t i = 0, reals = words_.count(); i < reals; ++i) {
      const auto value = words_.number<double>();
      if (i == 0) time_s = value;
    }
    std::vector<size_t> integers;
    for (size_t i = words_.count(); i > 0; --i)
      integers.push_back(words_.number<size_t>());
    if (integers.size() < 3 || integers[1] == 0 || integers[1] > 9)
      words_.fail("node data have no step, components and number of values");
    GridArray array{std::move(name), integers[1],
                    std::vector<double>(integers[1] * grid_.point_count(), 0.0)};
    for (size_t left = integers[2]; left > 0; --left) {
      const size_t point = node(words_.number<size_t>());
      for (size_t i = 0; i < array.components; ++i)
        array.values[point * array.components + i] = words_.number<double>();
    }
    auto step = std::ranges::find(grid_.steps, time_s, &GridStep::time_s);
    if (step == grid_.steps.end()) step = grid_.steps.insert(step, GridStep{time_s, {}, {}});
    step->point_data.push_back(std::move(array));
  }

  Words words_;
  int version_ = 0;
  FieldGrid grid_;
  std::unordered_map<size_t, size_t> node_of_;
  std::map<std::pair<int, int>, int> physical_of_;
  std::vector<double> physical_;
};

}  // namespace

FieldGrid read_gmsh(const std::string& path) {
  FieldGrid grid = GmshReader(path).read();
  require_sound(grid, path);
  return grid;
}

}  // namespace diastole
