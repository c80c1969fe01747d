#include "doppel/ros/record/bag_outputs.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <optional>

#include "doppel/base/core/names.h"
#include "doppel/ros/record/bag_copy.h"
#include "doppel/ros/record/pending_latched.h"

namespace doppel {
namespace {

constexpr const char* kRule = "bag_outputs.invalid";

// The next message of an input.
class Input {
 public:
  Input(BagReader& bag, const std::vector<OutputBag>& outputs) : bag_(bag) {
    TopicSelection topics;
    topics.hidden = true;
    for (const BagTopic& topic : bag.contents().topics) {
      if (std::ranges::any_of(outputs, [&](const OutputBag& output) {
            return output.topics.selects(topic.name, topic.type);
          }))
        topics.topics.push_back(topic.name);
    }
    if (topics.topics.empty()) return;
    bag_.seek(0, UINT64_MAX, topics);
    next_ = bag_.next();
  }
  [[nodiscard]] const std::optional<BagMessage>& next() const { return next_; }
  void take() { next_ = bag_.next(); }
  [[nodiscard]] const BagReader& bag() const { return bag_; }

 private:
  BagReader& bag_;
  std::optional<BagMessage> next_;
};

class Output {
 public:
  explicit Output(const OutputBag& about) : about_(about), writer_(about.bag) {}

  void write(std::size_t input, const BagReader& bag, const BagMessage& message) {
    if (message.log_time > about_.end) return;
    const std::optional<std::size_t> topic = topic_of(input, bag, message.topic);
    if (!topic) return;
    if (message.log_time < about_.start) {
      before_.keep(*topic, bag.latched(message.topic), message.sequence, message.publish_time, message.data);
      return;
    }
    before_.write(writer_, message.log_time);
    writer_.write(*topic, message.sequence, message.log_time, message.publish_time, message.data);
  }
  [[nodiscard]] BagWriter& writer() { return writer_; }
  void close() {
    before_.write(writer_, about_.start);
    writer_.close();
  }

 private:
  // The writer's topic; nullopt: not selected.
  std::optional<std::size_t> topic_of(std::size_t input, const BagReader& bag, std::size_t topic) {
    const auto [found, is_new] = topics_.try_emplace({input, topic});
    const BagTopic& about = bag.contents().topics[topic];
    if (is_new && about_.topics.selects(about.name, about.type))
      found->second = writer_.add_topic(recorded_topic(bag, topic));
    return found->second;
  }

  const OutputBag& about_;
  BagWriter writer_;
  PendingLatched before_;
  std::map<std::pair<std::size_t, std::size_t>, std::optional<std::size_t>> topics_;
};

using Outputs = std::vector<std::unique_ptr<Output>>;

// False: it was ended.
bool copy_messages(std::vector<BagReader>& bags, const std::vector<OutputBag>& about, Outputs& outputs,
                   const std::function<bool(double)>& progress) {
  constexpr std::uint64_t kLook = 4096;  // messages between two reports of progress
  std::vector<Input> inputs;
  double all = 0;
  for (BagReader& bag : bags) {
    inputs.emplace_back(bag, about);
    all += static_cast<double>(bag.contents().messages);
  }
  for (std::uint64_t count = 1;; ++count) {
    const auto earliest = std::ranges::min_element(
        inputs, {}, [](const Input& input) { return input.next() ? input.next()->log_time : UINT64_MAX; });
    if (earliest == inputs.end() || !earliest->next()) return true;
    const auto number = static_cast<std::size_t>(earliest - inputs.begin());
    for (const auto& output : outputs) output->write(number, earliest->bag(), *earliest->next());
    earliest->take();
    if (count % kLook == 0 && progress && !progress(static_cast<double>(count) / all)) return false;
  }
}

void check_selection(const std::vector<BagReader>& inputs, const OutputBag& output, Diagnostics& errors) {
  std::vector<std::string> names;
  bool any = false;
  for (const BagReader& bag : inputs) {
    for (const BagTopic& topic : bag.contents().topics) {
      names.push_back(topic.name);
      any = any || output.topics.selects(topic.name, topic.type);
    }
  }
  bool is_wrong = false;
  for (const std::string& name : output.topics.topics) {
    if (std::ranges::find(names, name) != names.end()) continue;
    is_wrong = true;
    const auto place = output.places.find(name);
    errors.error(kRule, place == output.places.end() ? output.where : place->second,
                 fmt::format("there is no topic {}{}", name, did_you_mean(name, names)),
                 "doppel bag info lists the topics");
  }
  if (!any && !is_wrong) {
    errors.error(kRule, output.where,
                 fmt::format("no topic of the recordings is selected for '{}'", output.bag.folder.string()),
                 "doppel bag info lists the topics with their types");
  }
}

}  // namespace

void check_output_bags(const std::vector<BagReader>& inputs, const std::vector<OutputBag>& outputs) {
  Diagnostics errors;
  std::uint64_t end = 0;
  for (const BagReader& bag : inputs) end = std::max(end, bag.contents().end);
  for (const OutputBag& output : outputs) {
    check_selection(inputs, output, errors);
    std::error_code none;
    if (std::filesystem::exists(output.bag.folder, none)) {
      errors.error("output.unwritable", output.where,
                   fmt::format("'{}' exists already", output.bag.folder.string()),
                   "name another folder, or remove this one; a bag is never appended to");
    }
    if (output.start > end) {
      errors.error(kRule, output.where,
                   fmt::format("start_time_ns {} is behind the end of the recordings, {}", output.start, end),
                   "give a time of the recording's clock; doppel bag info --json has its start and end");
    }
  }
  errors.throw_if_errors();
}

std::vector<WrittenBag> convert_bags(std::vector<BagReader>& inputs, const std::vector<OutputBag>& about,
                                     const std::function<bool(double)>& progress) {
  Outputs outputs;
  std::vector<WrittenBag> written;
  const auto discard = [&outputs] {
    for (const auto& output : outputs) output->writer().discard();
  };
  try {
    for (const OutputBag& one : about) outputs.push_back(std::make_unique<Output>(one));
    for (BagReader& bag : inputs) {
      for (const auto& output : outputs) copy_parts(bag, output->writer());
    }
    if (!copy_messages(inputs, about, outputs, progress)) {
      discard();
      return {};
    }
    for (const auto& output : outputs) {
      output->close();
      const BagWriter& writer = output->writer();
      written.push_back({writer.folder(), writer.metadata().messages, writer.size()});
    }
  } catch (...) {
    discard();
    throw;
  }
  return written;
}

}  // namespace doppel
