#include "tools/diastole/desk/tag_desk.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>

#include "estimator/imaging/tracking/tags_file.hpp"
#include "estimator/imaging/tracking/tracking_record.hpp"
#include "estimator/io/whole_file.hpp"
#include "estimator/parallel/parallel_for.hpp"
#include "estimator/report/cine.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/contract/json_text.hpp"
#include "tools/diastole/desk/embedded.hpp"

namespace diastole::desk {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

struct GivenUp {};

[[noreturn]] void refuse_file(const fs::path& file, const char* what) {
  throw InputError({file.string(), "", fmt::format("{}: {}", what, std::strerror(errno)),
                    "Make room, or name a file that may be written with --edits."});
}

/// One write to the end of the file, and the disk's word for it.
void append_line(const fs::path& file, const std::string& line) {
  const int descriptor = ::open(file.c_str(), O_WRONLY | O_APPEND | O_CREAT | O_CLOEXEC, 0644);
  if (descriptor < 0) refuse_file(file, "cannot be written");
  const bool is_written =
      ::write(descriptor, line.data(), line.size()) == static_cast<ssize_t>(line.size()) &&
      ::fsync(descriptor) == 0;
  ::close(descriptor);
  if (!is_written) refuse_file(file, "did not take the choice");
}

}  // namespace

TagDesk::TagDesk(const imaging::ImageFolder& folder, imaging::TrackRequest request,
                 std::optional<fs::path> tags)
    : request_(std::move(request)), tags_(std::move(tags)) {
  imaging::require_sound(folder);
  folder_problems_ = folder.problems;
  std::vector<Finding> reported_later;
  (void)imaging::stated_pose(request_, reported_later);  // a broken one is refused before anything is tracked
  views_ = imaging::tag_views(folder);
  edits_ = imaging::parse_edits(file_text(), edits_file());
  imaging::apply_edits(edits_, views_);
  track();
}

TagDesk::~TagDesk() {
  const std::scoped_lock lock(mutex_);
  ending_ = true;
}

std::span<const report::PageAsset> TagDesk::assets() const {
  static const std::array own{report::PageAsset{"/", "text/html; charset=utf-8", embedded::tags_html},
                              report::PageAsset{"/tags.js", "text/javascript", embedded::tags_js}};
  return own;
}

std::optional<DeskAnswer> TagDesk::get(std::string_view path) {
  if (path == "/state") return answered(json_text(state()));
  if (path != "/tracking") return std::nullopt;
  const auto known = tracking();
  return known ? DeskAnswer{200, known} : refused(503, "The first tracking is at work.");
}

std::optional<DeskAnswer> TagDesk::post(std::string_view path, const std::string& body) {
  if (path == "/edits") {
    append(body);
  } else if (path == "/track") {
    track();
  } else {
    return std::nullopt;
  }
  return answered(json_text(state()));
}

std::string TagDesk::file_text() const {
  std::error_code error;
  return fs::exists(edits_file(), error) ? read_whole_file(edits_file()) : std::string();
}

void TagDesk::append(const std::string& choice) {
  std::string line;
  try {
    line = json_text(json::parse(choice, no_deeper_than<json>()));  // on one line, whatever came
  } catch (const JsonTooDeep& error) {
    throw InputError({edits_file().string(), "", fmt::format("the choice is {}", error.what()),
                      "Send one object with a list of points."});
  } catch (const json::exception&) {
    throw InputError(
        {edits_file().string(), "", "the choice is no JSON: " + choice.substr(0, 60), "Send one object."});
  }
  std::string text = file_text();
  if (!text.empty() && !text.ends_with('\n')) line.insert(0, 1, '\n');
  const imaging::ManualEdits edits = imaging::parse_edits(text + line + "\n", edits_file());
  try {
    imaging::apply_edits(edits, views_);
  } catch (const InputError&) {
    imaging::apply_edits(edits_, views_);
    throw;
  }
  append_line(edits_file(), line + "\n");
  edits_ = edits;
}

json TagDesk::edits() const {
  json list = json::array();
  for (const imaging::ManualEdit& edit : edits_.standing) {
    json one = json::parse(edit.text);
    one["line"] = edit.file_line;
    list.push_back(std::move(one));
  }
  return list;
}

TagDesk::Choices TagDesk::choices() const {
  Choices choices;
  for (const imaging::ManualEdit& edit : edits_.standing)
    choices[edit.slice] += edit.text + "\n";
  return choices;
}

std::set<std::string> TagDesk::changed() const {
  const Choices now = choices();
  const auto of = [](const Choices& all, const std::string& name) {
    const auto found = all.find(name);
    return found == all.end() ? std::string() : found->second;
  };
  std::set<std::string> names;
  for (const imaging::TagView& view : views_) {
    if (of(now, view.name) != of(tracked_choices_, view.name)) names.insert(view.name);
  }
  return names;
}

void TagDesk::track() {
  const std::set<std::string> names = changed();
  std::vector<imaging::TagView> views;
  {
    const std::scoped_lock lock(mutex_);
    if (tracking_) return;
    for (const imaging::TagView& view : views_) {
      const bool is_known = slices_.contains(view.name) || faults_.contains(view.name);
      if (!is_known || names.contains(view.name)) views.push_back(view);
    }
    tracking_ = true;
    done_ = 0;
    of_ = views.size();
    problem_.clear();
  }
  tracked_choices_ = choices();
  if (worker_.joinable()) worker_.join();
  worker_ = std::jthread([this, views = std::move(views), edits = edits_]() mutable {
    work(std::move(views), std::move(edits));
  });
}

void TagDesk::work(std::vector<imaging::TagView> views, imaging::ManualEdits edits) {
  const auto start = std::chrono::steady_clock::now();
  std::string problem;
  std::shared_ptr<const std::string> payload;
  try {
    std::vector<std::string> names;
    for (const imaging::TagView& view : views)
      names.push_back(view.name);
    std::vector<Finding> problems;
    std::vector<imaging::TrackedSlice> fresh =
        imaging::track_views(std::move(views), machine_threads(), problems, [this](size_t done, size_t) {
          const std::scoped_lock lock(mutex_);
          done_ = done;
          if (ending_) throw GivenUp();
        });
    for (const std::string& name : names) {
      slices_.erase(name);
      faults_.erase(name);
    }
    for (const Finding& fault : problems)
      faults_.emplace(fault.where, fault);
    for (imaging::TrackedSlice& slice : fresh)
      slices_.insert_or_assign(slice.view.name, std::move(slice));
    payload = std::make_shared<const std::string>(
        payload_of(edits, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count()));
  } catch (const GivenUp&) {
    return;
  } catch (const std::exception& error) {
    problem = error.what();
  }
  const std::scoped_lock lock(mutex_);
  tracking_ = false;
  problem_ = problem;
  if (!payload) return;
  payload_ = payload;
  ++version_;
}

std::string TagDesk::payload_of(const imaging::ManualEdits& edits, double seconds) const {
  std::vector<Finding> problems = folder_problems_;
  for (const auto& [name, fault] : faults_)
    problems.push_back(fault);
  std::vector<imaging::TrackedSlice> slices;
  for (const imaging::TagView& view : views_) {
    if (const auto found = slices_.find(view.name); found != slices_.end()) slices.push_back(found->second);
  }
  imaging::TrackRequest request = request_;
  request.known_pose = imaging::stated_pose(request, problems);  // it may have been written meanwhile
  const imaging::TrackedFolder tracked =
      imaging::gathered(request, edits, std::move(slices), std::move(problems));
  if (tags_) write_whole_file(*tags_, imaging::tags_file_text(tracked.points));
  const TrackingRecord record = imaging::tracking_record(tracked, seconds);
  return fmt::format(R"({{"html": {}, "record": {}}})", json_text(json(report::cine_players(record))),
                     to_json(record));
}

json TagDesk::state() const {
  const size_t count = changed().size();
  const std::scoped_lock lock(mutex_);
  return {{"tracking", tracking_}, {"done", done_},    {"of", of_},       {"version", version_},
          {"problem", problem_},   {"changed", count}, {"edits", edits()}};
}

std::shared_ptr<const std::string> TagDesk::tracking() const {
  const std::scoped_lock lock(mutex_);
  return payload_;
}

}  // namespace diastole::desk
