#pragma once
// What the people at the rig know of a session: as options of a command, as questions in a terminal, in words and as JSON.

#include <CLI/CLI.hpp>
#include <cstdio>
#include <istream>
#include <nlohmann/json.hpp>
#include <string>

#include "host/rpc/run_session.hpp"
#include "protocol/runfile/session.hpp"

namespace diastole {

/// --specimen, --operator, --room-temperature-C, --note. `facts` must live until the command has run.
void add_facts_to(CLI::App& command, SessionFacts& facts);

/// Asks for what is not there yet, one line each; an empty line leaves it open, the operator then is the system's user. A
/// temperature that is none is asked for again. Ends with the input.
void ask_for(SessionFacts& facts, std::istream& answers, std::FILE* questions);

/// The login name of who runs this program.
std::string own_user_name();

/// {"specimen", "operator", "room_temperature_C", "notes": [{"written_utc", "author", "text"}]}; what is not known is null.
nlohmann::json session_json(const runfile::Session& session);

/// One line for the facts and one for each note; none if nothing is known.
std::string session_words(const runfile::Session& session);

}  // namespace diastole
