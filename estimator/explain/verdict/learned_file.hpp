#pragma once
// learned.effect.toml beside an explanation: a suggestion that a person reads, names and changes, and learned-2.effect.toml ... for
// laws that predict as well. Their first line holds a fingerprint of the rest, by which a file that nobody touched is known.

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace diastole::explain {

constexpr size_t most_learned_laws = 3;
/// "learned", "learned-2": the best law's id, and those of others.
std::string learned_id(size_t law);
std::filesystem::path learned_file_name(size_t law);

/// Before long work. Throws InputError if the path cannot become a file, is one of `inputs`, or holds what somebody wrote or
/// changed and there is no `force`.
void require_learned_file(const std::filesystem::path& path, const std::vector<std::filesystem::path>& inputs,
                          bool force);
/// Of an effect file's text. Throws InputError if it cannot be written.
void write_learned_file(const std::filesystem::path& path, std::string_view toml);
/// Of an earlier explanation; what somebody wrote or changed stays.
void remove_learned_file(const std::filesystem::path& path);

}  // namespace diastole::explain
