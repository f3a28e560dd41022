#include "protocol/runfile/session.hpp"

#include <fmt/format.h>

#include "protocol/runfile/h5_source.hpp"
#include "protocol/runfile/layout.hpp"

namespace diastole::runfile {

Session read_session(const std::filesystem::path& path) { return read_session(H5Source(path)); }

Session read_session(const H5Source& source) {
  Session session;
  if (!source.has(session_group)) return session;
  session.facts = source.attributes(session_group);
  for (const std::string& name : source.children(session_notes)) {
    const std::string dataset = fmt::format("{}/{}", session_notes, name);
    const Session about{source.attributes(dataset), {}};
    session.notes.push_back({about.text(note_written), about.text(note_author), source.text(dataset)});
  }
  return session;
}

}  // namespace diastole::runfile
