#pragma once
// The inputs and hashes of a run since its first step, as a small bag of its own: with it and the files of
// the run a recording of the last seconds can be run again. It grows with what clients ask for, not with
// time, but for one hash a second.

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "doppel/export.h"
#include "doppel/ros/bus/bus.h"
#include "doppel/ros/record/bag_writer.h"

namespace doppel {

inline constexpr const char* kJournalAttachment = "run.mcap";

// One thread.
class DOPPEL_API RunJournal {
 public:
  // folder: is made. Beyond `max_size` bytes the journal ends and its files are removed.
  RunJournal(std::filesystem::path folder, std::string distro, std::uint64_t max_size);

  // Inputs and hashes; messages of other topics are ignored.
  void write(const BagTopicCount& topic, const Edge::Incoming& message);
  // Inputs are in the file half a second later, hashes alone a minute later.
  void look(std::chrono::steady_clock::time_point now);
  // Everything so far is in the file.
  void flush();
  // Why the journal has ended: its size, or a disk that is full. Empty: it goes on.
  [[nodiscard]] const std::string& end() const { return end_; }

 private:
  void give_up(const std::string& why);

  const std::filesystem::path folder_;
  const std::uint64_t max_size_;
  BagWriter writer_;
  std::map<std::string, std::size_t> topics_;
  std::uint64_t time_ = 0;   // log times ascend, also where a reset sets time back, so that there is one file
  bool has_inputs_ = false;  // that are not in the file
  std::chrono::steady_clock::time_point flushed_{};
  std::string end_;
};

// The journal in a folder as kJournalAttachment, a whole MCAP file, also while it is written and after its
// process was killed. nullopt: there is none.
[[nodiscard]] DOPPEL_API std::optional<BagAttachment> journal_attachment(const std::filesystem::path& folder);

}  // namespace doppel
