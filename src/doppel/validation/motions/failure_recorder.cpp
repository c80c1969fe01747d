#include "doppel/validation/motions/detail/failure_recorder.h"

#include <fmt/format.h>

#include <algorithm>

namespace doppel {
namespace {

constexpr std::size_t kMaxName = 80;  // characters, of a part in a file's name

bool is_used(const std::vector<FailureRecording>& recordings, const std::string& file) {
  return std::ranges::find(recordings, file, &FailureRecording::file) != recordings.end();
}

std::string file_safe(std::string text) {
  std::ranges::replace_if(
      text,
      [](char c) {
        const bool is_letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
        return !is_letter && !(c >= '0' && c <= '9') && c != '-' && c != '.' && c != '_';
      },
      '_');
  return text.substr(0, kMaxName);
}

}  // namespace

std::string recording_file(const std::string& check, const std::string& part,
                           const std::vector<FailureRecording>& others) {
  const std::string name = check + "_" + file_safe(part);
  std::string out = name + ".mcap";
  for (int number = 2; is_used(others, out); ++number) out = fmt::format("{}_{}.mcap", name, number);
  return out;
}

void FailureRecorder::record(CheckItem& item, const std::string& part, MachineRun& machine,
                             const std::function<void()>& repeat) {
  record(item, part, [&] {
    machine.start_recording();
    repeat();
    return machine.finish_recording();
  });
}

void FailureRecorder::record(CheckItem& item, const std::string& part,
                             const std::function<RecordedMotion()>& motion) {
  if (!context_.record || !parts_.insert(part).second) return;
  if (out_.recordings.size() >= kMaxRecordings) {
    if (!is_capped_)
      out_.notes.push_back(
          fmt::format("the first {} joints that fail have a recording, and no more", kMaxRecordings));
    is_capped_ = true;
    return;
  }
  RecordedMotion recorded = motion();
  item.recording = recording_file(out_.id, part, out_.recordings);
  for (const std::string& note : recorded.notes)
    out_.notes.push_back(fmt::format("{}: {}", item.recording, note));
  out_.recordings.push_back(
      {item.recording, std::make_shared<const std::vector<std::byte>>(std::move(recorded.bytes))});
}

}  // namespace doppel
