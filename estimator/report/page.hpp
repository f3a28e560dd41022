#pragma once
// A self-contained HTML page: one file, no network, readable without JavaScript and on paper. Sections hold
// paragraphs, tables, figures (inline SVG) and time charts; a time chart shows its SVG until the embedded
// uPlot takes its place with a zoomable trace.

#include <string>
#include <string_view>
#include <vector>

namespace diastole::report {

/// Near the start of each page.
inline constexpr std::string_view page_mark = "content=\"diastole report\"";

struct Figure {
  std::string svg;
  std::string caption;  ///< plain words; it is escaped
};

/// A drawing as a file of its own, with the page's colours; `title` is what a browser shows under the pointer.
std::string standalone(std::string svg, const std::string& title);

/// A trace against time. Both the SVG and the chart are drawn from the same numbers.
struct TimeChart {
  struct Trace {
    std::string name;  ///< with its unit
    std::string style;
    std::vector<double> y;  ///< as long as `time_s`; NaN leaves a hole
  };
  std::vector<double> time_s;
  std::vector<Trace> traces;
  std::string y_label;
  std::vector<double> marks_s;  ///< vertical marks (triggers)
  std::string caption;
};

class Page {
 public:
  explicit Page(std::string title) : title_(std::move(title)) {}

  /// One of the figures at the head of the page: "C1", "8.57 ± 0.08 kPa", "95 % interval 8.41 to 8.73 kPa".
  void headline(const std::string& label, const std::string& value, const std::string& note);

  void section(const std::string& title, const std::string& lead);
  void paragraph(const std::string& text);
  /// A remark that the reader must not miss.
  void warning(const std::string& text);
  /// Figures side by side where the width allows.
  void figures(const std::vector<Figure>& row);
  void time_chart(const TimeChart& chart);
  /// First column left-aligned, the others as numbers, and from column `words_from` on as words that may wrap.
  using Row = std::vector<std::string>;
  void table(const Row& header, const std::vector<Row>& rows, const std::string& caption,
             size_t words_from = std::string::npos);
  /// The same, with one row of each item.
  template <class Items, class RowOf>
  void table_of(const Items& items, const Row& header, const RowOf& row_of, const std::string& caption,
                size_t words_from = std::string::npos) {
    std::vector<Row> rows;
    for (const auto& item : items)
      rows.push_back(row_of(item));
    table(header, rows, caption, words_from);
  }
  /// A part with a style and a script of its own, which finds `data` (JSON) under that name.
  void part(const std::string& html, std::string_view css, std::string_view script,
            const std::string& data_name, const std::string& data);
  /// Preformatted text that unfolds on a click.
  void listing(const std::string& title, const std::string& text);

  [[nodiscard]] std::string html() const;

 private:
  std::string title_;
  std::string headlines_;
  std::string body_;
  bool in_section_ = false;
  std::vector<std::string> charts_;  // JSON for page.js
  std::string part_css_, part_scripts_;
};

}  // namespace diastole::report
