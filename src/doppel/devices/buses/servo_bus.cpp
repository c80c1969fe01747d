#include "doppel/devices/buses/servo_bus.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "doppel/devices/buses/detail/missing_answers.h"
#include "doppel/devices/buses/detail/packet_codec.h"

namespace doppel {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr int kBroadcast = 0xFE, kLastId = 252;
// A host that is busy with other programs is late by some tens of milliseconds.
constexpr Duration kDefaultPatience{50'000'000};

struct Span {
  std::size_t begin = 0, size = 0;
};

// The block of registers with all of these roles that the model has.
Span block_of(const ServoModel& model, std::initializer_list<ServoRole> roles) {
  std::size_t begin = std::numeric_limits<std::size_t>::max(), end = 0;
  for (const ServoRole role : roles) {
    const ServoRegister* const one = model.find(role);
    if (one == nullptr) continue;
    begin = std::min(begin, static_cast<std::size_t>(one->address));
    end = std::max(end, static_cast<std::size_t>(one->address) + one->size);
  }
  return {begin, end - begin};
}

// The value of a register in a block that begins at `begin`; nullopt: it is not within.
std::optional<std::int64_t> value_in(std::span<const std::uint8_t> block, std::size_t begin,
                                     const ServoRegister* which) {
  if (which == nullptr || which->address < begin || which->address + which->size > begin + block.size())
    return {};
  return decode_register(*which, block.subspan(which->address - begin, which->size));
}

// Every servo of a protocol has the number of its model at the same address.
const ServoRegister& model_number(ServoProtocol protocol) {
  const char* const any = protocol == ServoProtocol::feetech ? "STS3215" : "XL430-W250";
  return *find_servo_model(any)->find("Model_Number");
}

std::int64_t clamped(double value, double low, double high) {
  return std::llround(std::clamp(value, low, high));
}

}  // namespace

ServoReading::ServoReading()
    : position(kNone), velocity(kNone), load(kNone), current(kNone), voltage(kNone), temperature(kNone) {}

ServoBus::ServoBus(ByteLink& link, ServoProtocol protocol, int rate)
    : link_(link),
      protocol_(protocol),
      rate_(rate),
      patience_(kDefaultPatience),
      codec_(make_packet_codec(protocol)),
      missing_(std::make_unique<MissingAnswers>()) {}

ServoBus::~ServoBus() = default;

// -- requests and answers

Time ServoBus::answer_deadline(std::size_t bytes, std::size_t answers) const {
  const double bits = kBitsPerByte * static_cast<double>(bytes + request_.size());
  // Each servo waits for its return delay, which is at most half a millisecond.
  constexpr Duration kMaxDelay{510'000};
  return link_.now() + patience_ + from_seconds(bits / rate_) +
         static_cast<std::int64_t>(answers) * kMaxDelay;
}

bool ServoBus::send() {
  ++counts_.requests;
  codec_->clear();
  link_.discard();
  return link_.write(request_.bytes());
}

// A link keeps the order of its bytes, so that what comes before the echo are earlier answers and echoes. An
// echo that stayed in the stream would be taken for an answer.
bool ServoBus::drop_echo() {
  if (!echo_) return true;
  const std::span<const std::uint8_t> echo = request_.bytes();
  const Time deadline = answer_deadline(0, 0);
  FrameBytes received;
  for (;;) {
    std::array<std::uint8_t, 256> bytes{};
    const std::size_t count = link_.read(bytes, deadline);
    if (count == 0) return false;
    received.add(std::span(bytes).first(count));
    const std::span<const std::uint8_t> all = received.bytes();
    const auto found = std::search(all.begin(), all.end(), echo.begin(), echo.end());
    if (found != all.end()) {
      codec_->push(all.subspan(static_cast<std::size_t>(found - all.begin()) + echo.size()));
      return true;
    }
    if (link_.now() >= deadline) return false;
    // The last bytes may be the beginning of the echo.
    if (all.size() >= echo.size()) received.drop(all.size() - (echo.size() - 1));
  }
}

// A link returns bytes that are there after the deadline, too: a partner that sends noise without end would
// keep the host here for ever.
std::optional<ServoBus::Answer> ServoBus::receive(Time deadline) {
  for (bool in_time = true;; in_time = link_.now() < deadline) {
    if (const auto status = codec_->next()) return Answer{status->id, status->error, status->data};
    if (!in_time) return {};
    std::array<std::uint8_t, 256> bytes{};
    const std::size_t count = link_.read(bytes, deadline);
    if (count == 0) return {};
    codec_->push(std::span(bytes).first(count));
  }
}

void ServoBus::finish_counts() {
  counts_.bad_checks = codec_->counts().bad_checks;
  counts_.noise = codec_->counts().noise;
}

std::optional<ServoBus::Answer> ServoBus::transact(int id, std::size_t answer_bytes) {
  const bool in_doubt = missing_->has(id, answer_bytes), can_refuse = !missing_->has(id, 0);
  newest_.reset();
  if (!in_doubt) newest_ = {id, answer_bytes};
  sent_ = link_.now();
  if (send() && drop_echo()) {
    const Time deadline = answer_deadline(codec_->answer_size(answer_bytes), 1);
    while (const auto answer = receive(deadline)) {
      const bool refuses = can_refuse && answer->data.empty() && answer->error != 0;
      if (answer->id != id || (answer->data.size() != answer_bytes && !refuses)) {
        ++counts_.strangers;
        if (link_.now() >= deadline) break;
        continue;
      }
      if (!in_doubt) missing_->forget();
      finish_counts();
      last_error_ = answer->error;
      return answer;
    }
  }
  finish_counts();
  ++counts_.lost;
  missing_->add(id, answer_bytes);
  return {};
}

std::optional<std::size_t> ServoBus::extra_bytes(std::span<const std::uint8_t> ids, std::size_t size) {
  const std::optional<std::size_t> out = missing_->extra(ids, size);
  if (out || !settle()) return out;
  return 0;
}

// So many answers are missing that the link stands still, or the servos are gone. More requests would only
// make the queue of late answers longer: they wait until it has come to the last one, or will not come any
// more. A late echo looks like an answer, so that only silence ends the doubt of a link with echoes.
bool ServoBus::settle() {
  constexpr Duration kGivenUp{250'000'000};
  const Time end = link_.now() + kGivenUp;
  while (link_.now() < end) {
    const auto answer = receive(std::min(end, link_.now() + patience_));
    if (!answer) break;
    heard_ = link_.now();
    const bool is_newest = newest_ && newest_->size == answer->data.size() && newest_->id == answer->id;
    if (is_newest && !echo_) return end_doubt();
  }
  return link_.now() - std::max(sent_, heard_) >= kGivenUp && end_doubt();
}

bool ServoBus::end_doubt() {
  missing_->forget();
  return true;
}

bool ServoBus::catch_up(int id, const ServoRegister& any) {
  return !missing_->has(id, 0) || read_block(id, any.address, any.size).has_value();
}

void ServoBus::notice_echo() {
  if (protocol_ != ServoProtocol::feetech) return;  // the codec tells requests from answers
  echo_ = false;
  request_.clear();
  codec_->add_ping(kBroadcast, request_);
  if (!send()) return;
  // No servo answers with the broadcast id.
  const Time deadline = answer_deadline(codec_->answer_size(0), 1);
  while (const auto answer = receive(deadline)) {
    echo_ = echo_ || answer->id == kBroadcast;
    if (link_.now() >= deadline) break;
  }
}

std::optional<PingAnswer> ServoBus::ping(int id, int tries) {
  // Feetech's answer to a ping has no data.
  const std::size_t data = protocol_ == ServoProtocol::dynamixel ? 3 : 0;
  for (int i = 0; i < tries; ++i) {
    // The echoes of two pings are equal, and look like their answers: the echo of a read in between shows
    // that those before it have come.
    if (echo_ && !catch_up(id, model_number(protocol_))) continue;
    // A late answer shows as well that the servo is there, but its data may be those of registers.
    const bool in_doubt = missing_->has(id, data);
    request_.clear();
    codec_->add_ping(id, request_);
    const auto answer = transact(id, data);
    if (!answer) continue;
    PingAnswer out{id, 0, 0, answer->error, 1};
    if (!answer->data.empty() && !in_doubt) {
      out.number = static_cast<std::uint16_t>(answer->data[0] | (answer->data[1] << 8));
      out.firmware = answer->data[2];
      return out;
    }
    // A servo that is there is asked again: an answer that a busy machine loses would make its model unknown.
    constexpr int kModelTries = 3;
    const auto number = read(id, model_number(protocol_), kModelTries);
    out.number = static_cast<std::uint16_t>(number.value_or(0));
    return out;
  }
  return {};
}

std::vector<PingAnswer> ServoBus::ping_all(int last_id) {
  std::vector<int> ids;
  if (protocol_ == ServoProtocol::dynamixel) {
    request_.clear();
    codec_->add_ping(kBroadcast, request_);
    if (!send()) return {};
    const Time deadline = answer_deadline(kLastId * codec_->answer_size(0), kLastId);
    while (const auto answer = receive(deadline)) {
      ids.push_back(answer->id);
      if (link_.now() >= deadline) break;
    }
    finish_counts();
    std::ranges::sort(ids);
    ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  } else {
    // The answers to a broadcast may meet on the line, so that each id is asked for itself.
    for (int id = 0; id <= kLastId; ++id) ids.push_back(id);
  }
  std::vector<PingAnswer> out;
  for (const int id : ids) {
    if (id > last_id) break;
    std::optional<PingAnswer> answer = ping(id, 1);
    if (!answer) continue;
    answer->answers = is_shared(*answer) ? 2 : 1;
    out.push_back(*answer);
  }
  return out;
}

// Servos that share an id give equal answers to a ping, and damage each other's answers about what differs.
bool ServoBus::is_shared(const PingAnswer& servo) {
  const ServoModel* const model = find_servo_model(protocol_, servo.number);
  if (model == nullptr) return false;
  const Span block = block_of(*model, {ServoRole::present_position, ServoRole::present_velocity,
                                       ServoRole::present_voltage, ServoRole::present_temperature});
  constexpr int kTries = 3;
  int damaged = 0;
  for (int i = 0; i < kTries; ++i) {
    const std::uint64_t before = codec_->counts().bad_checks;
    const bool whole = read_block(servo.id, block.begin, block.size).has_value();
    damaged += !whole && codec_->counts().bad_checks > before ? 1 : 0;
  }
  return damaged == kTries;
}

std::optional<std::span<const std::uint8_t>> ServoBus::read_block(int id, std::size_t address,
                                                                  std::size_t size) {
  const std::array<std::uint8_t, 1> ids{static_cast<std::uint8_t>(id)};
  const std::optional<std::size_t> extra = extra_bytes(ids, size);
  if (!extra) return {};
  const std::size_t front = std::min(*extra, address);
  request_.clear();
  codec_->add_read(id, address - front, size + *extra, request_);
  const auto answer = transact(id, size + *extra);
  if (!answer || answer->data.size() != size + *extra) return {};
  return answer->data.subspan(front, size);
}

std::optional<std::int64_t> ServoBus::read(int id, const ServoRegister& which, int tries) {
  for (int i = 0; i < tries; ++i) {
    if (const auto data = read_block(id, which.address, which.size)) return decode_register(which, *data);
  }
  return {};
}

bool ServoBus::write(int id, const ServoRegister& which, std::int64_t value, int tries) {
  std::array<std::uint8_t, 8> bytes{};
  encode_register(which, value, bytes);
  for (int i = 0; i < tries; ++i) {
    // The write is sent in any case: it may be the one that switches a torque off.
    const bool in_step = id == kBroadcast || catch_up(id, which);
    request_.clear();
    codec_->add_write(id, which.address, std::span(bytes).first(which.size), request_);
    if (id == kBroadcast) return send() && drop_echo();
    if (transact(id, 0) && in_step) return true;
  }
  return false;
}

bool ServoBus::reboot(int id) {
  if (protocol_ != ServoProtocol::dynamixel) return false;
  // It is sent in any case, as a write is.
  const bool in_step = catch_up(id, model_number(protocol_));
  request_.clear();
  return codec_->add_reboot(id, request_) && transact(id, 0) && in_step;
}

// -- the cycle

void ServoBus::begin_cycle(std::span<const BusServo> servos, bool fast) {
  servos_.assign(servos.begin(), servos.end());
  fast_ = fast && protocol_ == ServoProtocol::dynamixel;
  ids_.clear();
  for (const BusServo& one : servos_) ids_.push_back(static_cast<std::uint8_t>(one.id));
  if (servos_.empty()) return;
  const ServoModel& model = *servos_.front().model;
  using enum ServoRole;
  // Feetech's current is far from the others; it is part of the health.
  const bool feetech = protocol_ == ServoProtocol::feetech;
  const Span read =
      feetech ? block_of(model, {present_position, present_velocity, present_load})
              : block_of(model, {present_position, present_velocity, present_load, present_current});
  const Span write = feetech ? block_of(model, {goal_acceleration, goal_position, goal_velocity})
                             : block_of(model, {goal_position});
  read_begin_ = read.begin;
  read_size_ = read.size;
  write_begin_ = write.begin;
  write_size_ = write.size;
  goals_.assign(servos_.size() * (write_size_ + 1), 0);
  health_ = 0;
}

void ServoBus::decode_motion(std::span<const std::uint8_t> block, unsigned error, std::size_t index,
                             ServoReading& reading) const {
  const ServoModel& model = *servos_[index].model;
  const auto value = [&](ServoRole role) { return value_in(block, read_begin_, model.find(role)); };
  if (const auto ticks = value(ServoRole::present_position)) reading.position = model.angle(*ticks);
  if (const auto speed = value(ServoRole::present_velocity))
    reading.velocity = static_cast<double>(*speed) * model.velocity_unit;
  if (const auto load = value(ServoRole::present_load))
    reading.load = static_cast<double>(*load) * model.load_unit;
  if (const auto current = value(ServoRole::present_current)) {
    reading.current = static_cast<double>(*current) * model.current_unit;
    if (model.load_unit == 0 && model.stall_current > 0) reading.load = reading.current / model.stall_current;
  }
  // Dynamixel's error byte only says that the register of errors has something to say.
  if (protocol_ == ServoProtocol::feetech) reading.faults = model.faults(error);
}

std::size_t ServoBus::read_all(std::span<ServoReading> readings) {
  for (ServoReading& one : readings) one.fresh = false;
  if (ids_.empty()) return 0;
  const std::optional<std::size_t> extra = extra_bytes(ids_, read_size_);
  std::size_t fresh = 0;
  const std::size_t step = codec_->max_read(read_size_ + MissingAnswers::kMaxExtra, fast_);
  for (std::size_t begin = 0; extra && begin < servos_.size(); begin += step)
    fresh += read_some(begin, std::min(step, servos_.size() - begin), *extra, readings);
  counts_.lost += servos_.size() - fresh;
  return fresh;
}

std::size_t ServoBus::read_some(std::size_t begin, std::size_t count, std::size_t extra,
                                std::span<ServoReading> readings) {
  const std::span<const std::uint8_t> ids = std::span(ids_).subspan(begin, count);
  const std::size_t size = read_size_ + extra, front = std::min(extra, read_begin_);
  request_.clear();
  codec_->add_sync_read(ids, read_begin_ - front, size, fast_, request_);
  newest_ = {ids.back(), size};
  sent_ = link_.now();
  std::size_t fresh = 0;
  if (send() && drop_echo()) {
    const Time deadline = answer_deadline(count * codec_->answer_size(size), count);
    while (fresh < count) {
      const auto answer = receive(deadline);
      if (!answer) break;
      const auto place = std::ranges::find(ids, static_cast<std::uint8_t>(answer->id));
      if (place == ids.end() || answer->data.size() != size) {
        ++counts_.strangers;
        if (link_.now() >= deadline) break;
        continue;
      }
      missing_->forget();
      const std::size_t index = begin + static_cast<std::size_t>(place - ids.begin());
      // One of two answers with the same id is another servo's, and nothing says which.
      if (readings[index].fresh) {
        counts_.strangers += 2;
        readings[index].fresh = false;
        --fresh;
        if (link_.now() >= deadline) break;
        continue;
      }
      decode_motion(answer->data.subspan(front, read_size_), answer->error, index, readings[index]);
      readings[index].when = link_.now();
      readings[index].fresh = true;
      ++fresh;
    }
  }
  for (std::size_t i = begin; i < begin + count; ++i) {
    if (!readings[i].fresh) missing_->add(servos_[i].id, size);
  }
  finish_counts();
  return fresh;
}

bool ServoBus::read_health(std::span<ServoReading> readings) {
  if (servos_.empty()) return false;
  const std::size_t index = health_;
  health_ = (health_ + 1) % servos_.size();
  const ServoModel& model = *servos_[index].model;
  ServoReading& reading = readings[index];
  using enum ServoRole;
  const bool feetech = protocol_ == ServoProtocol::feetech;
  const Span block = feetech
                         ? block_of(model, {present_voltage, present_temperature, errors, present_current})
                         : block_of(model, {present_voltage, present_temperature});
  const auto data = read_block(servos_[index].id, block.begin, block.size);
  if (!data) return false;
  const auto value = [&](ServoRole role) { return value_in(*data, block.begin, model.find(role)); };
  if (const auto voltage = value(present_voltage))
    reading.voltage = static_cast<double>(*voltage) * model.voltage_unit;
  if (const auto degrees = value(present_temperature)) reading.temperature = static_cast<double>(*degrees);
  if (const auto current = value(present_current))
    reading.current = static_cast<double>(*current) * model.current_unit;
  if (const auto status = value(errors)) reading.faults = model.faults(*status);
  if (feetech) return true;
  const auto status = read(servos_[index].id, *model.find(errors), 1);
  if (status) reading.faults = model.faults(*status);
  return status.has_value();
}

void ServoBus::encode_goal(const ServoGoal& goal, std::size_t index, std::span<std::uint8_t> block) const {
  const ServoModel& model = *servos_[index].model;
  block[0] = ids_[index];
  const auto put = [&](ServoRole role, std::int64_t value) {
    const ServoRegister* const one = model.find(role);
    if (one == nullptr || one->address < write_begin_ ||
        one->address + one->size > write_begin_ + write_size_)
      return;
    encode_register(*one, value, block.subspan(1 + one->address - write_begin_, one->size));
  };
  // One turn: the drivers' joints have no more.
  put(ServoRole::goal_position,
      clamped(model.ticks(goal.position), 0, static_cast<double>(model.ticks_per_turn - 1)));
  constexpr double kMaxSpeed = 32767;
  put(ServoRole::goal_velocity, clamped(goal.velocity / model.velocity_unit, 0, kMaxSpeed));
}

bool ServoBus::write_goals(std::span<const ServoGoal> goals) {
  const std::size_t part = write_size_ + 1;  // bytes of one servo
  std::size_t written = 0;
  for (std::size_t i = 0; i < servos_.size(); ++i) {
    if (std::isfinite(goals[i].position))
      encode_goal(goals[i], i, std::span(goals_).subspan(written++ * part, part));
  }
  if (written == 0) return !link_.is_lost();
  const std::size_t step = codec_->max_written(write_size_);
  for (std::size_t begin = 0; begin < written; begin += step) {
    request_.clear();
    codec_->add_sync_write(std::span(goals_).subspan(begin * part, std::min(step, written - begin) * part),
                           write_begin_, write_size_, request_);
    if (!send()) return false;
    // Goals have no answer, so that nothing is lost with a late echo: the next request drops it.
    static_cast<void>(drop_echo());
  }
  return true;
}

}  // namespace doppel
