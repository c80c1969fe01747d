// Contacts and ContactsState from the contacts of a sensor's links.
#include <algorithm>
#include <set>

#include "doppel/base/core/names.h"
#include "doppel/ros/messages/gazebo_msgs.h"
#include "doppel/ros/messages/ros_gz_interfaces.h"
#include "doppel/sensors/rigs/detail/delay_line.h"
#include "doppel/sensors/rigs/detail/physical_sensor.h"
#include "doppel/sensors/rigs/pose_messages.h"

namespace doppel {
namespace {

using BumperState = gazebo_msgs::msg::ContactState;
using gazebo_msgs::msg::ContactsState;
using ContactEntry = ros_gz_interfaces::msg::Contact;
using ros_gz_interfaces::msg::Contacts;
using ros_gz_interfaces::msg::JointWrench;

// Of one sensor; more of them allocate in the loop, and so do delayed messages until the first ones are sent.
constexpr std::size_t kUsualPairs = 16, kUsualPoints = 16, kUsualName = 128;
// The text that Gazebo's conversion of a URDF inserts where a link is merged into the one that carries it.
constexpr std::string_view kMerged = "_fixed_joint_lump__";

// The names that Gazebo gives the collisions of a link: as written, else LINK_collision, LINK_collision_1.
std::vector<std::string> collision_names(const Link& link) {
  std::vector<std::string> out;
  for (std::size_t i = 0; i < link.collisions.size(); ++i) {
    const std::string& written = link.collisions[i].name;
    out.push_back(!written.empty() ? written
                  : i == 0         ? link.name + "_collision"
                                   : link.name + "_collision_" + std::to_string(i));
  }
  return out;
}

std::string_view without_merged_prefix(std::string_view name) {
  const std::size_t at = name.find(kMerged);
  return at == std::string_view::npos ? name : name.substr(at + kMerged.size());
}

// True if a collision of this link is meant: by its name, or by the one that the conversion makes of the link's.
bool is_meant(const Link& link, std::string_view written) {
  const std::string_view name = without_merged_prefix(written);
  const std::string made = link.name + "_collision";
  if (!link.collisions.empty() && name.starts_with(made) &&
      name.substr(made.size()).find_first_not_of("_0123456789") == std::string_view::npos)
    return true;
  return std::ranges::any_of(collision_names(link), [&](const std::string& one) { return one == name; });
}

// "model::link::collision", as Gazebo names shapes.
std::string scoped_collision(const ModelInstance& instance, int link) {
  const std::string& name = instance.model->links[static_cast<std::size_t>(link)].name;
  if (instance.is_object()) {
    const bool one_link = instance.model->links.size() == (instance.floating() ? 2U : 1U);
    return instance.name + "::" + (one_link ? "link" : name) + "::collision";
  }
  const Link* described = instance.description ? instance.description->find_link(name) : nullptr;
  const auto names = described == nullptr ? std::vector<std::string>{} : collision_names(*described);
  return instance.name + "::" + name + "::" + (names.empty() ? name + "_collision" : names.front());
}

// A contact as the sensor's collision feels it, in the axes of the data.
struct OwnContact {
  BodyId own, other;
  Eigen::Vector3d p, normal, force, torque;  // m; unit, into the own collision; N and N m, on it
  double depth = 0;                          // m
};

class ContactOutput : public PhysicalSensor {
 public:
  ContactOutput(Node& node, const RigSensor& sensor, double period, const Log& log)
      : PhysicalSensor(sensor),
        described_(std::get<ContactDescription>(sensor.description.what)),
        log_(log),
        in_world_(sensor.description.frame.empty() || sensor.description.frame == "world"),
        message_(blank<Contacts>(in_world_ ? "world" : sensor.frame)),
        states_(blank<ContactsState>(message_.header.frame_id)),
        delayed_(described_.bumper ? 0 : sensor.description.latency, period, message_),
        delayed_states_(described_.bumper ? sensor.description.latency : 0, period, states_) {
    if (described_.bumper)
      bumper_ = advertise<ContactsState>(node, "bumper");
    else
      contacts_ = advertise<Contacts>(node, "contact");
    frame_ = message_.header.frame_id;
    reserve();
  }

  [[nodiscard]] bool wanted() const override {
    return described_.bumper ? bumper_.has_listeners() : contacts_.has_listeners();
  }
  [[nodiscard]] bool needs_contacts() const override { return true; }

  void bind(const Engine& engine, int instance) override;
  void restart(const Engine& /*engine*/) override {
    delayed_.clear();
    delayed_states_.clear();
  }
  void resume(const PhysicalSensor& before, std::uint64_t /*next*/) override {
    const auto* former = dynamic_cast<const ContactOutput*>(&before);
    if (former == nullptr || !same_values(sensor_, former->sensor_)) return;
    delayed_.resume(former->delayed_);
    delayed_states_.resume(former->delayed_states_);
  }
  void save(SavedSlot& slot) const override { value_in<Saved>(slot) = {hash_, delayed_, delayed_states_}; }
  void restore(const SavedPart& saved) override {
    const Saved* const before = value_of<Saved>(&saved);
    if (before == nullptr) return;
    hash_ = before->hash;
    delayed_ = before->delayed;
    delayed_states_ = before->delayed_states;
  }
  void publish(const PhysicalState& state, std::uint64_t sample) override;
  void release(Time now) override {
    delayed_.release(now, [&](const Contacts& message) { contacts_.publish(message, now); });
    delayed_states_.release(now, [&](const ContactsState& states) { bumper_.publish(states, now); });
  }
  [[nodiscard]] Time next_release() const override {
    return std::min(delayed_.next_release(), delayed_states_.next_release());
  }

 private:
  template <class M>
  static M blank(const std::string& frame) {
    M out;
    out.header.frame_id = frame;
    return out;
  }
  // The message gets the memory of one that was sent.
  template <class M>
  static void finish(Publisher<M>& publisher, M& message, DelayLine<M>& delayed, Time now) {
    if (delayed.delays())
      std::swap(delayed.add(now), message);
    else
      publisher.publish(message, now);
  }
  void reserve();
  void find_links(const ModelInstance& instance);
  [[nodiscard]] bool has(BodyId body) const {
    return body.instance == instance_ && links_[static_cast<std::size_t>(body.link)] != 0;
  }
  [[nodiscard]] const std::string& name_of(BodyId body) const {
    return body.is_ground()
               ? ground_
               : names_[static_cast<std::size_t>(body.instance)][static_cast<std::size_t>(body.link)];
  }
  // The present axes of the data in the world.
  [[nodiscard]] Pose X_WD(const Engine& engine) const;
  void recycle();
  ContactEntry& entry_of(BodyId own, BodyId other);
  BumperState& state_of(BodyId own, BodyId other);
  void add(const OwnContact& contact, const std_msgs::msg::Header& header);
  void add_to_bumper(const OwnContact& contact);

  struct Saved {
    std::uint64_t hash = 0;
    DelayLine<Contacts> delayed;
    DelayLine<ContactsState> delayed_states;
  };

  const ContactDescription described_;
  const Log& log_;
  std::set<std::string> reported_;  // names of collisions that are not there
  const bool in_world_;
  int world_link_ = -1;                          // of TF's frame "world"; -1: that of the simulation
  std::vector<char> links_;                      // [links] of the sensor's instance
  std::vector<std::vector<std::string>> names_;  // [instances][links]
  const std::string ground_ = "ground::link::collision";
  Contacts message_;
  std::vector<ContactEntry> spare_;
  std::vector<JointWrench> spare_wrenches_;
  ContactsState states_;
  std::vector<BumperState> spare_states_;
  DelayLine<Contacts> delayed_;
  DelayLine<ContactsState> delayed_states_;
  Publisher<Contacts> contacts_;
  Publisher<ContactsState> bumper_;
};

void ContactOutput::reserve() {
  message_.contacts.reserve(kUsualPairs);
  spare_.resize(kUsualPairs);
  spare_wrenches_.resize(kUsualPairs * kUsualPoints);
  for (ContactEntry& entry : spare_) {
    entry.collision1.name.reserve(kUsualName);
    entry.collision2.name.reserve(kUsualName);
    entry.positions.reserve(kUsualPoints);
    entry.normals.reserve(kUsualPoints);
    entry.depths.reserve(kUsualPoints);
    entry.wrenches.reserve(kUsualPoints);
  }
  for (JointWrench& wrench : spare_wrenches_) {
    wrench.header.frame_id = frame_;
    wrench.body_1_name.data.reserve(kUsualName);
    wrench.body_2_name.data.reserve(kUsualName);
  }
  states_.states.reserve(kUsualPairs);
  spare_states_.resize(kUsualPairs);
  for (BumperState& state : spare_states_) {
    state.info.reserve(2 * kUsualName);
    state.collision1_name.reserve(kUsualName);
    state.collision2_name.reserve(kUsualName);
    state.wrenches.reserve(kUsualPoints);
    state.contact_positions.reserve(kUsualPoints);
    state.contact_normals.reserve(kUsualPoints);
    state.depths.reserve(kUsualPoints);
  }
}

void ContactOutput::bind(const Engine& engine, int instance) {
  PhysicalSensor::bind(engine, instance);
  names_.clear();
  for (const ModelInstance& of : engine.world().instances()) {
    auto& of_links = names_.emplace_back();
    for (int link = 0; link < static_cast<int>(of.model->links.size()); ++link)
      of_links.push_back(scoped_collision(of, link));
  }
  if (instance < 0) return;
  const ModelInstance& own = engine.world().instances()[static_cast<std::size_t>(instance)];
  world_link_ = sensor_.name_space.empty() ? own.model->find_link("world") : -1;
  find_links(own);
}

// A name may be that of a link that Gazebo merges into the sensor's.
void ContactOutput::find_links(const ModelInstance& instance) {
  links_.assign(instance.model->links.size(), 0);
  if (described_.collisions.empty()) links_[static_cast<std::size_t>(sensor_.link)] = 1;
  for (const std::string& name : described_.collisions) {
    bool found = false;
    std::vector<std::string> known;
    for (const Link& link : instance.description->links) {
      for (std::string& one : collision_names(link)) known.push_back(std::move(one));
      if (!is_meant(link, name)) continue;
      found = true;
      links_[static_cast<std::size_t>(instance.model->find_link(link.name))] = 1;
    }
    if (!found && reported_.insert(name).second)
      log_.warning("sensors", sensor_key(sensor_) + " names the collision '" + name +
                                  "', which no link of the robot has" +
                                  did_you_mean(without_merged_prefix(name), known) +
                                  "; it reports no contact of it");
  }
}

Pose ContactOutput::X_WD(const Engine& engine) const {
  const Instance own = engine.instance(instance_);
  if (!in_world_) return own.link_pose(sensor_.link) * sensor_.X_LF;
  return world_link_ < 0 ? Pose(Pose::Identity()) : own.link_pose(world_link_);
}

void ContactOutput::recycle() {
  for (ContactEntry& entry : message_.contacts) {
    for (JointWrench& wrench : entry.wrenches) spare_wrenches_.push_back(std::move(wrench));
    entry.wrenches.clear();
    entry.positions.clear();
    entry.normals.clear();
    entry.depths.clear();
    spare_.push_back(std::move(entry));
  }
  message_.contacts.clear();
  for (BumperState& state : states_.states) {
    state.wrenches.clear();
    state.contact_positions.clear();
    state.contact_normals.clear();
    state.depths.clear();
    spare_states_.push_back(std::move(state));
  }
  states_.states.clear();
}

ContactEntry& ContactOutput::entry_of(BodyId own, BodyId other) {
  const std::string &first = name_of(own), &second = name_of(other);
  for (ContactEntry& entry : message_.contacts)
    if (entry.collision1.name == first && entry.collision2.name == second) return entry;
  ContactEntry& entry = message_.contacts.emplace_back(taken(spare_));
  entry.collision1.name = first;
  entry.collision2.name = second;
  entry.collision1.type = entry.collision2.type = ros_gz_interfaces::msg::Entity::COLLISION;
  return entry;
}

BumperState& ContactOutput::state_of(BodyId own, BodyId other) {
  const std::string &first = name_of(own), &second = name_of(other);
  for (BumperState& state : states_.states)
    if (state.collision1_name == first && state.collision2_name == second) return state;
  BumperState& state = states_.states.emplace_back(taken(spare_states_));
  state.info.assign(first).append(" touches ").append(second);
  state.collision1_name = first;
  state.collision2_name = second;
  state.total_wrench = {};
  return state;
}

void ContactOutput::add(const OwnContact& contact, const std_msgs::msg::Header& header) {
  ContactEntry& entry = entry_of(contact.own, contact.other);
  entry.positions.push_back(to_vector_msg(contact.p));
  entry.normals.push_back(to_vector_msg(contact.normal));
  entry.depths.push_back(contact.depth);
  JointWrench& wrench = entry.wrenches.emplace_back(taken(spare_wrenches_));
  wrench.header.stamp = header.stamp;
  wrench.header.frame_id = header.frame_id;
  wrench.body_1_name.data = entry.collision1.name;
  wrench.body_2_name.data = entry.collision2.name;
  wrench.body_1_wrench.force = to_vector_msg(contact.force);
  wrench.body_2_wrench.force = to_vector_msg(-contact.force);
  wrench.body_1_wrench.torque = to_vector_msg(contact.torque);
  wrench.body_2_wrench.torque = to_vector_msg(-contact.torque);
}

void ContactOutput::add_to_bumper(const OwnContact& contact) {
  BumperState& state = state_of(contact.own, contact.other);
  state.wrenches.push_back({to_vector_msg(contact.force), to_vector_msg(contact.torque)});
  state.total_wrench.force.x += contact.force.x();
  state.total_wrench.force.y += contact.force.y();
  state.total_wrench.force.z += contact.force.z();
  state.total_wrench.torque.x += contact.torque.x();
  state.total_wrench.torque.y += contact.torque.y();
  state.total_wrench.torque.z += contact.torque.z();
  state.contact_positions.push_back(to_vector_msg(contact.p));
  state.contact_normals.push_back(to_vector_msg(contact.normal));
  state.depths.push_back(contact.depth);
}

void ContactOutput::publish(const PhysicalState& state, std::uint64_t /*sample*/) {
  recycle();
  message_.header.stamp = states_.header.stamp = to_time_msg(state.stamp);
  const Pose X_DW = X_WD(state.engine).inverse();
  for (const Contact& contact : state.contacts) {
    for (const bool own_is_a : {true, false}) {
      const BodyId own = own_is_a ? contact.a : contact.b, other = own_is_a ? contact.b : contact.a;
      if (!has(own)) continue;
      // The engine's force acts on b, and its normal points to b.
      const double sign = own_is_a ? -1 : 1;
      const OwnContact seen{own,
                            other,
                            X_DW * contact.p_W,
                            X_DW.linear() * (sign * contact.normal_W),
                            X_DW.linear() * (sign * contact.force_W),
                            X_DW.linear() * (sign * contact.torque_W),
                            contact.depth};
      hash_vector(to_vector_msg(seen.p));
      hash_vector(to_vector_msg(seen.force));
      hash_vector(to_vector_msg(seen.torque));
      if (described_.bumper)
        add_to_bumper(seen);
      else
        add(seen, message_.header);
    }
  }
  if (described_.bumper)
    finish(bumper_, states_, delayed_states_, state.now);
  else
    finish(contacts_, message_, delayed_, state.now);
}

}  // namespace

std::unique_ptr<PhysicalSensor> make_contact_output(Node& node, const RigSensor& sensor, double period,
                                                    const Log& log) {
  return std::make_unique<ContactOutput>(node, sensor, period, log);
}

}  // namespace doppel
