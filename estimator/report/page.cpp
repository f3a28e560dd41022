#include "estimator/report/page.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "estimator/io/member_json.hpp"
#include "estimator/report/embedded.hpp"
#include "estimator/report/html_text.hpp"
#include "estimator/report/svg_plot.hpp"
#include "protocol/contract/json_text.hpp"

namespace diastole::report {
namespace {

// What a paper-sized figure can show: more points would only make the file large.
constexpr size_t static_points = 1500;

/// Of every bucket its least and its greatest sample, so that no peak is lost; short traces stay as they are.
std::vector<size_t> envelope(const std::vector<double>& y, size_t at_most) {
  std::vector<size_t> kept;
  const size_t bucket = std::max<size_t>(1, 2 * y.size() / at_most);
  for (size_t from = 0; from < y.size(); from += bucket) {
    const auto begin = y.begin() + static_cast<std::ptrdiff_t>(from);
    const auto end = y.begin() + static_cast<std::ptrdiff_t>(std::min(from + bucket, y.size()));
    const auto [low, high] = std::minmax_element(begin, end);
    const auto first = std::min(low, high), second = std::max(low, high);
    kept.push_back(static_cast<size_t>(first - y.begin()));
    if (second != first) kept.push_back(static_cast<size_t>(second - y.begin()));
  }
  return kept;
}

std::string static_svg(const TimeChart& chart) {
  SvgPlot plot({.x = {.label = "time (s)"}, .y = {.label = chart.y_label}, .width = 1120, .height = 300});
  plot.marks(chart.marks_s, "muted");
  for (const TimeChart::Trace& trace : chart.traces) {
    std::vector<double> x, y;
    for (const size_t i : envelope(trace.y, static_points)) {
      x.push_back(chart.time_s[i]);
      y.push_back(trace.y[i]);
    }
    plot.line(x, y, trace.style, trace.name);
  }
  return plot.svg();
}

/// To a ten-thousandth, which is more than a screen shows.
double shortened(double value) { return std::round(value * 1e4) / 1e4; }

/// "</script>" in a text would end the script.
std::string script_safe(std::string json) {
  for (size_t at = 0; (at = json.find('<', at)) != std::string::npos;)
    json.replace(at, 1, "\\u003c");
  return json;
}

std::string chart_json(const TimeChart& chart) {
  Json json{{"label", chart.y_label}, {"traces", Json::array()}};
  json["marks"] = written(chart.marks_s);
  json["data"].push_back(written(chart.time_s));
  for (const TimeChart::Trace& trace : chart.traces) {
    json["traces"].push_back({{"name", trace.name}, {"style", trace.style}});
    json["data"].push_back(written(trace.y));
  }
  round_numbers(json, shortened);
  return script_safe(json_text(json));
}

std::string figure_html(const std::string& body, const std::string& caption) {
  return fmt::format("<figure>{}<figcaption>{}</figcaption></figure>\n", body, escaped(caption));
}

}  // namespace

std::string standalone(std::string svg, const std::string& title) {
  svg.insert(
      svg.find('>') + 1,
      fmt::format("<title>{}</title><style>{}</style><rect width=\"100%\" height=\"100%\" fill=\"white\"/>",
                  escaped(title), embedded::page_css));
  svg.insert(svg.find("<svg") + 4, " xmlns=\"http://www.w3.org/2000/svg\"");
  return svg + "\n";
}

void Page::headline(const std::string& label, const std::string& value, const std::string& note) {
  headlines_ +=
      fmt::format("<div class=\"headline\"><span>{}</span><strong>{}</strong><small>{}</small></div>\n",
                  escaped(label), escaped(value), escaped(note));
}

void Page::section(const std::string& title, const std::string& lead) {
  if (in_section_) body_ += "</section>\n";
  in_section_ = true;
  body_ += fmt::format("<section>\n<h2>{}</h2>\n<p class=\"lead\">{}</p>\n", escaped(title), escaped(lead));
}

void Page::paragraph(const std::string& text) { body_ += fmt::format("<p>{}</p>\n", escaped(text)); }

void Page::warning(const std::string& text) {
  body_ += fmt::format("<p class=\"warning\">{}</p>\n", escaped(text));
}

void Page::figures(const std::vector<Figure>& row) {
  body_ += "<div class=\"row\">\n";
  for (const Figure& figure : row)
    body_ += figure_html(figure.svg, figure.caption);
  body_ += "</div>\n";
}

void Page::time_chart(const TimeChart& chart) {
  const std::string holder =
      fmt::format("<div class=\"chart\" data-chart=\"{}\">{}</div>", charts_.size(), static_svg(chart));
  body_ += figure_html(holder, chart.caption);
  charts_.push_back(chart_json(chart));
  charts_.back().shrink_to_fit();
}

void Page::table(const Row& header, const std::vector<Row>& rows, const std::string& caption,
                 size_t words_from) {
  const auto row_html = [words_from](const Row& cells, const char* tag) {
    std::string text = "<tr>";
    for (size_t i = 0; i < cells.size(); ++i)
      text +=
          fmt::format("<{0}{1}>{2}</{0}>", tag, i >= words_from ? " class=\"words\"" : "", escaped(cells[i]));
    return text + "</tr>\n";
  };
  std::string text = "<table><thead>" + row_html(header, "th") + "</thead><tbody>\n";
  for (const auto& row : rows)
    text += row_html(row, "td");
  body_ += figure_html(text + "</tbody></table>", caption);
}

void Page::part(const std::string& html, std::string_view css, std::string_view script,
                const std::string& data_name, const std::string& data) {
  body_ += html;
  part_css_ += css;
  part_scripts_ +=
      fmt::format("<script>\nconst {} = {};\n{}</script>\n", data_name, script_safe(data), script);
}

void Page::listing(const std::string& title, const std::string& text) {
  body_ +=
      fmt::format("<details><summary>{}</summary><pre>{}</pre></details>\n", escaped(title), escaped(text));
}

std::string Page::html() const {
  std::string text = "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n";
  text += fmt::format("<meta name=\"generator\" {}>\n", page_mark);
  text += "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n";
  text += fmt::format("<title>{}</title>\n<style>\n", escaped(title_));
  if (!charts_.empty()) text += std::string(embedded::uplot_css) + "\n";
  text += std::string(embedded::page_css) + part_css_ + "</style>\n</head>\n<body>\n";
  text += fmt::format(
      "<header><p class=\"brand\">Diastole</p><h1>{}</h1>\n<div class=\"headlines\">\n{}</div></header>\n",
      escaped(title_), headlines_);
  size_t bulk = body_.size() + part_scripts_.size();
  for (const std::string& chart : charts_)
    bulk += chart.size();
  text.reserve(text.size() + bulk + embedded::uplot_js.size() + embedded::page_js.size() + 10'000);
  text += "<main>\n";
  text += body_;
  text += in_section_ ? "</section>\n</main>\n" : "</main>\n";
  if (!charts_.empty()) {
    text += "<script>\nconst charts = [";
    for (const std::string& chart : charts_)
      text.append(chart).append(",\n");
    text += fmt::format("];\n/*\n{}\n*/\n", embedded::uplot_licence);
    // The script's own first line is a banner with an address; the licence above says the same without one.
    const std::string_view script = embedded::uplot_js;
    text += script.substr(script.find('\n') + 1);
    text += std::string(embedded::page_js) + "</script>\n";
  }
  text += part_scripts_;
  text += "</body>\n</html>\n";
  return text;
}

}  // namespace diastole::report
