#include "doppel/twin/attachments/detail/attachment_services.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <stdexcept>
#include <utility>

#include "doppel/ros/messages/gazebo_ros_link_attacher.h"
#include "doppel/ros/messages/linkattacher_msgs.h"
#include "doppel/ros/messages/std_srvs.h"
#include "doppel/twin/entities/entity.h"

namespace doppel {
namespace {

constexpr const char* kAttachOrigin = "attach";
constexpr Duration kLookPeriod{20'000'000};  // of what a vacuum or a gripper could hold

}  // namespace

class AttachmentServices::Device {
 public:
  Device(AttachmentServices& services, std::string instance)
      : services_(services), instance_(std::move(instance)) {}
  virtual ~Device() = default;
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;

  virtual void between_steps(Time now) = 0;
  virtual void reset() = 0;

  // The state of a device, for the one that replaces it after an edit: `key` is the same as long as
  // it is the same device to its user.
  struct Memory {
    std::string key;
    std::optional<Wanted> held;
    bool is_on = false;
    // For a saved state only: a new device looks, asks and publishes anew.
    bool refused = false, published = false;
    Time next_look{}, last_look{};
    std::optional<Time> since;
  };
  [[nodiscard]] virtual Memory memory() const = 0;
  // Becomes as it was when the engine, which has the attachments, was saved.
  virtual void restore_memory(const Memory& saved) { held_ = saved.held; }
  virtual void resume(const Memory& before) {
    held_ = before.held;
    restore();
  }
  // After a change of instances: what it held stays attached, as far as it is still there.
  void restore() {
    BodyId a, b;
    if (!held_) return;
    if (!services_.find(held_->a, a) || !services_.find(held_->b, b)) return held_.reset();
    if (services_.are_attached(a, b)) return;
    if (!services_.attach(a, b)) held_.reset();
  }
  // After a reset, or if the body was deleted or detached by a service.
  void forget_lost() {
    BodyId a, b;
    const bool there =
        held_ && services_.find(held_->a, a) && services_.find(held_->b, b) && services_.are_attached(a, b);
    if (!there) held_.reset();
  }

 protected:
  [[nodiscard]] const Scene& scene() const { return services_.scene_; }
  [[nodiscard]] const std::string& instance() const { return instance_; }
  [[nodiscard]] std::optional<BodyId> link(const std::string& name) const {
    BodyId out;
    return services_.find({instance_, name}, out) ? std::optional(out) : std::nullopt;
  }
  // Attached by this device.
  [[nodiscard]] bool holds() const { return held_.has_value(); }
  void hold(BodyId own, BodyId other) {
    if (services_.attach(own, other)) held_ = {services_.name_of(own), services_.name_of(other)};
  }
  void release() {
    BodyId a, b;
    if (held_ && services_.find(held_->a, a) && services_.find(held_->b, b)) services_.detach(a, b);
    held_.reset();
  }
  [[nodiscard]] Memory memory_of(const std::string& key, bool is_on = false) const {
    Memory out;
    out.key = key;
    out.held = held_;
    out.is_on = is_on;
    return out;
  }

  AttachmentServices& services_;

 private:
  const std::string instance_;
  std::optional<Wanted> held_;
};

class AttachmentServices::Joint : public Device {
 public:
  Joint(AttachmentServices& services, const std::string& instance, DetachableJoint joint)
      : Device(services, instance), joint_(std::move(joint)), node_(services.node_.bus(), "/gazebo") {
    state_ = node_.advertise<std_msgs::msg::String>(joint_.output_topic);
    node_.subscribe<std_msgs::msg::Empty>(joint_.attach_topic, [this](const auto&) {
      services_.ask_to_attach(own(), child());
      refused_ = false;
    });
    node_.subscribe<std_msgs::msg::Empty>(joint_.detach_topic,
                                          [this](const auto&) { services_.ask_to_detach(own(), child()); });
  }

  void between_steps(Time now) override {
    const bool held = holds();
    if (held) forget_lost();
    if (services_.is_to_be_detached(own(), child())) {
      release();
    } else if (!holds()) {
      try_to_hold();
    }
    if (held != holds() || !published_) state_.publish({holds() ? "attached" : "detached"}, now);
    published_ = true;
  }
  void reset() override {
    forget_lost();
    refused_ = false;
  }
  [[nodiscard]] Memory memory() const override {
    Memory out =
        memory_of("joint " + joint_.parent_link + " " + joint_.child_model + " " + joint_.child_link);
    out.refused = refused_;
    out.published = published_;
    return out;
  }
  void restore_memory(const Memory& saved) override {
    Device::restore_memory(saved);
    refused_ = saved.refused;
    published_ = saved.published;
  }

 private:
  // A refusal is final until the child is gone, or a client asks again.
  void try_to_hold() {
    BodyId other;
    const auto parent = link(joint_.parent_link);
    const bool there = services_.find_body(joint_.child_model, joint_.child_link, other).ok();
    if (!there) refused_ = false;
    if (!parent || !there || refused_) return;
    hold(*parent, other);
    refused_ = !holds();
  }
  [[nodiscard]] LinkName own() const { return {instance(), joint_.parent_link}; }
  [[nodiscard]] LinkName child() const {
    BodyId found;
    if (services_.find_body(joint_.child_model, joint_.child_link, found)) return services_.name_of(found);
    return {joint_.child_model, joint_.child_link};
  }

  const DetachableJoint joint_;
  Node node_;
  Publisher<std_msgs::msg::String> state_;
  bool refused_ = false, published_ = false;
};

// A device that looks periodically for what it could hold.
class AttachmentServices::Searcher : public Device {
 public:
  using Device::Device;

  void restore_memory(const Memory& saved) override {
    Device::restore_memory(saved);
    next_look_ = saved.next_look;
    last_look_ = saved.last_look;
  }

 protected:
  // Also after time was set back.
  bool begin_look(Time now) {
    if (now < next_look_ && now >= last_look_) return false;
    last_look_ = now;
    next_look_ = now + kLookPeriod;
    return true;
  }
  [[nodiscard]] Memory searching_memory(const std::string& key, bool is_on = false) const {
    Memory out = memory_of(key, is_on);
    out.next_look = next_look_;
    out.last_look = last_look_;
    return out;
  }

 private:
  Time next_look_{}, last_look_{};
};

class AttachmentServices::Vacuum : public Searcher {
 public:
  Vacuum(AttachmentServices& services, const std::string& instance, VacuumGripper vacuum)
      : Searcher(services, instance), vacuum_(std::move(vacuum)), node_(services.node_.bus(), "/gazebo") {
    using std_srvs::srv::Empty;
    using std_srvs::srv::SetBool;
    grasping_ = node_.advertise<std_msgs::msg::Bool>(vacuum_.grasping_topic);
    if (!vacuum_.switch_service.empty()) {
      node_.serve<SetBool>(vacuum_.switch_service,
                           [this](const SetBool::Request& r, const Responder<SetBool::Response>& respond) {
                             on_ = r.data;
                             respond({true, on_ ? "the vacuum is on" : "the vacuum is off"});
                           });
      return;
    }
    for (const bool on : {true, false}) {
      node_.serve<Empty>(on ? vacuum_.on_service : vacuum_.off_service,
                         [this, on](const Empty::Request&, const Responder<Empty::Response>& respond) {
                           on_ = on;
                           respond({});
                         });
    }
  }

  void between_steps(Time now) override {
    if (!on_ && holds()) release();
    if (!begin_look(now)) return;
    forget_lost();
    if (on_ && !holds()) attract();
    if (grasping_.has_listeners()) grasping_.publish({holds()}, now);
  }
  void reset() override {
    forget_lost();
    on_ = false;
  }
  [[nodiscard]] Memory memory() const override { return searching_memory("vacuum " + vacuum_.link, on_); }
  void restore_memory(const Memory& saved) override {
    Searcher::restore_memory(saved);
    on_ = saved.is_on;
  }
  void resume(const Memory& before) override {
    Device::resume(before);
    on_ = before.is_on;
  }

 private:
  [[nodiscard]] bool is_attached(int instance) const {
    return std::ranges::any_of(scene().engine().attachments(), [instance](const Attachment& of) {
      return of.a.instance == instance || of.b.instance == instance;
    });
  }
  // Fixes the nearest body within reach that nothing else is attached to, or one that touches the link.
  void attract() {
    const auto own = link(vacuum_.link);
    if (!own) return;
    const Eigen::Vector3d p_W = scene().instance(own->instance).link_pose(own->link).translation();
    scene().engine().contacts(contacts_);
    std::optional<BodyId> nearest;
    double best = vacuum_.reach;
    for (const int index : scene().objects()) {
      const Instance object = scene().instance(index);
      if (index == own->instance || is_attached(index) || !can_be_held(object.made_of())) continue;
      const BodyId body{index, object.made_of().base_link()};
      const bool touches = std::ranges::any_of(contacts_, [&](const Contact& contact) {
        return (contact.a == *own && contact.b == body) || (contact.b == *own && contact.a == body);
      });
      const double distance = touches ? 0.0 : (object.base_pose().translation() - p_W).norm();
      if (distance > best) continue;
      best = distance;
      nearest = body;
    }
    if (nearest) hold(*own, *nearest);
  }

  const VacuumGripper vacuum_;
  Node node_;
  Publisher<std_msgs::msg::Bool> grasping_;
  std::vector<Contact> contacts_;
  bool on_ = false;
};

class AttachmentServices::Gripper : public Searcher {
 public:
  Gripper(AttachmentServices& services, const std::string& instance, GripperCheck check)
      : Searcher(services, instance), check_(std::move(check)) {}

  void between_steps(Time now) override {
    if (!begin_look(now)) return;
    forget_lost();
    look(now);
  }
  void reset() override {
    forget_lost();
    since_.reset();
  }
  [[nodiscard]] Memory memory() const override {
    Memory out = searching_memory("gripper " + check_.palm);
    out.since = since_;
    return out;
  }
  void restore_memory(const Memory& saved) override {
    Searcher::restore_memory(saved);
    since_ = saved.since;
  }

 private:
  // Attaches what has been held, and releases what has not, for the time of that many steps.
  void look(Time now) {
    const auto palm = link(check_.palm);
    if (!palm) return;
    scene().engine().contacts(contacts_);
    find_grasps(scene().engine().world(), contacts_, grasps_);
    const auto grasp =
        std::ranges::find_if(grasps_, [&](const Grasp& of) { return counts(of, palm->instance); });
    if ((grasp != grasps_.end()) == holds()) return since_.reset();
    if (!since_ || *since_ > now) since_ = now;
    const int steps = holds() ? check_.detach_steps : check_.attach_steps;
    if (now - *since_ < steps * scene().engine().world().settings().step) return;
    since_.reset();
    if (holds()) {
      release();
    } else {
      hold(*palm, grasp->body);
    }
  }
  // At least two of the gripper's links hold it, with enough contacts.
  [[nodiscard]] bool counts(const Grasp& grasp, int robot) const {
    if (grasp.robot != robot) return false;
    const Model& model = scene().instance(robot).model();
    const auto is_finger = [&](int link) {
      return std::ranges::find(check_.links, model.links[static_cast<std::size_t>(link)].name) !=
             check_.links.end();
    };
    const auto fingers =
        std::ranges::count_if(grasp.links, [&](const GraspLink& of) { return is_finger(of.link); });
    const auto contacts = std::ranges::count_if(contacts_, [&](const Contact& contact) {
      const BodyId& other = contact.a == grasp.body ? contact.b : contact.a;
      return (contact.a == grasp.body || contact.b == grasp.body) && other.instance == robot &&
             is_finger(other.link);
    });
    return fingers >= 2 && contacts >= check_.min_contacts;
  }

  const GripperCheck check_;
  std::vector<Contact> contacts_;
  std::vector<Grasp> grasps_;
  std::optional<Time> since_;  // of the opposite of what is the case
};

AttachmentServices::AttachmentServices(Bus& bus, const Scene& scene, const Log& log)
    : scene_(scene), log_(log), node_(bus, "/gazebo") {
  offer_services();
  instances_changed();
}

AttachmentServices::~AttachmentServices() = default;

void AttachmentServices::between_steps(Time now) {
  for (const Equipped& of : equipped_) {
    for (const auto& device : of.devices) device->between_steps(now);
  }
}

void AttachmentServices::reset(Time /*now*/) {
  wanted_.clear();
  detached_.clear();
  for (const Equipped& of : equipped_) {
    for (const auto& device : of.devices) device->reset();
  }
}

struct AttachmentServices::Saved {
  std::vector<Wanted> attached, detached;
  std::vector<std::pair<std::string, std::vector<Device::Memory>>> devices;  // by instance
};

void AttachmentServices::save(SavedSlot& slot) {
  Saved& out = value_in<Saved>(slot);
  out.attached = wanted_;
  out.detached = detached_;
  out.devices.clear();
  for (const Equipped& equipped : equipped_) {
    if (equipped.devices.empty()) continue;
    auto& memories = out.devices.emplace_back(equipped.instance, std::vector<Device::Memory>{}).second;
    for (const auto& device : equipped.devices) memories.push_back(device->memory());
  }
}

void AttachmentServices::restore(const SavedPart* saved, Time /*now*/) {
  const Saved* const before = value_of<Saved>(saved);
  if (before == nullptr) return;
  wanted_ = before->attached;
  detached_ = before->detached;
  for (const auto& [instance, memories] : before->devices) {
    const auto equipped = std::ranges::find(equipped_, instance, &Equipped::instance);
    if (equipped == equipped_.end()) continue;
    for (const auto& device : equipped->devices) {
      const auto memory = std::ranges::find(memories, device->memory().key, &Device::Memory::key);
      if (memory != memories.end()) device->restore_memory(*memory);
    }
  }
}

// Makes the devices of new instances, which continue those of instances that a reload replaced, and restores
// what was attached to replaced instances.
void AttachmentServices::instances_changed() {
  const auto& instances = scene_.engine().world().instances();
  std::vector<std::pair<std::string, Device::Memory>> former;  // by instance
  std::erase_if(equipped_, [&](const Equipped& of) {
    const int index = find_instance(instances, of.instance);
    if (index >= 0 && instances[static_cast<std::size_t>(index)].model == of.model) return false;
    for (const auto& device : of.devices) former.emplace_back(of.instance, device->memory());
    return true;
  });
  for (const Equipped& of : equipped_) {
    for (const auto& device : of.devices) device->restore();
  }
  for (const ModelInstance& instance : instances) {
    if (std::ranges::find(equipped_, instance.name, &Equipped::instance) != equipped_.end()) continue;
    Equipped& fresh = equipped_.emplace_back();
    equip(instance, fresh);
    for (const auto& device : fresh.devices) {
      const std::string key = device->memory().key;
      const auto before = std::ranges::find_if(
          former, [&](const auto& of) { return of.first == instance.name && of.second.key == key; });
      if (before != former.end()) device->resume(before->second);
    }
  }
  std::erase_if(wanted_, [&](const Wanted& of) {
    BodyId a, b;
    if (!find(of.a, a) || !find(of.b, b)) return true;
    if (are_attached(a, b)) return false;
    return !scene_.engine().attach(a, b);
  });
}

void AttachmentServices::equip(const ModelInstance& instance, Equipped& out) {
  Diagnostics notes;
  AttachmentPlugins plugins = attachment_plugins_of(*instance.description, instance.name, notes);
  out.instance = instance.name;
  out.model = instance.model;
  // The bus refuses a name that another robot's device has, and a topic of another type.
  const auto add = [&](const auto& make) {
    try {
      out.devices.push_back(make());
    } catch (const std::logic_error& taken) {
      log_.warning(kAttachOrigin,
                   fmt::format("a plugin of '{}' attaches nothing: {}; give it names of its own",
                               instance.name, taken.what()));
    }
  };
  for (DetachableJoint& joint : plugins.joints)
    add([&] { return std::make_unique<Joint>(*this, instance.name, std::move(joint)); });
  for (VacuumGripper& vacuum : plugins.vacuums)
    add([&] { return std::make_unique<Vacuum>(*this, instance.name, std::move(vacuum)); });
  for (GripperCheck& gripper : plugins.grippers)
    out.devices.push_back(std::make_unique<Gripper>(*this, instance.name, std::move(gripper)));
  for (const Diagnostic& note : notes.all())
    log_.warning(kAttachOrigin, (note.where.known() ? note.where.place() + ": " : "") + note.message);
}

AttachmentServices::LinkName AttachmentServices::name_of(BodyId body) const {
  const Instance of = scene_.instance(body.instance);
  return {of.name(), of.model().links[static_cast<std::size_t>(body.link)].name};
}

bool AttachmentServices::find(const LinkName& name, BodyId& body) const {
  body.instance = scene_.find(name.instance);
  if (body.instance < 0) return false;
  body.link = scene_.instance(body.instance).model().find_link(name.link);
  return body.link >= 0;
}

Status AttachmentServices::find_body(const std::string& model, const std::string& link, BodyId& body) const {
  Entity entity;
  const std::string name = model.empty() ? link : link.empty() ? model : model + "::" + link;
  if (const Status found = find_entity(scene_, name, entity); !found) return found;
  body = entity.body;
  return {};
}

bool AttachmentServices::are_attached(BodyId a, BodyId b) const {
  return std::ranges::any_of(scene_.engine().attachments(),
                             [&](const Attachment& of) { return of.joins(a, b); });
}

Status AttachmentServices::attach(BodyId a, BodyId b) {
  const Status status = scene_.engine().attach(a, b);
  const LinkName first = name_of(a), second = name_of(b);
  const std::string names =
      fmt::format("'{}::{}' and '{}::{}'", first.instance, first.link, second.instance, second.link);
  if (status) {
    log_.note(kAttachOrigin, names + " are attached to each other");
  } else if (status.why() != last_refusal_) {
    last_refusal_ = status.why();  // logged once, also if a device tries again
    log_.warning(kAttachOrigin, fmt::format("{} are not attached: {}", names, last_refusal_));
  }
  return status;
}

bool AttachmentServices::detach(BodyId a, BodyId b) {
  if (!scene_.engine().detach(a, b)) return false;
  const LinkName first = name_of(a), second = name_of(b);
  std::erase_if(wanted_, [&](const Wanted& of) { return of.joins(first, second); });
  for (const Equipped& of : equipped_) {
    for (const auto& device : of.devices) device->forget_lost();
  }
  log_.note(kAttachOrigin, fmt::format("'{}::{}' and '{}::{}' are detached", first.instance, first.link,
                                       second.instance, second.link));
  return true;
}

void AttachmentServices::ask_to_detach(const LinkName& a, const LinkName& b) {
  if (!is_to_be_detached(a, b)) detached_.push_back({a, b});
}

void AttachmentServices::ask_to_attach(const LinkName& a, const LinkName& b) {
  std::erase_if(detached_, [&](const Wanted& of) { return of.joins(a, b); });
}

bool AttachmentServices::is_to_be_detached(const LinkName& a, const LinkName& b) const {
  return std::ranges::any_of(detached_, [&](const Wanted& of) { return of.joins(a, b); });
}

Status AttachmentServices::join(const std::string& model_1, const std::string& link_1,
                                const std::string& model_2, const std::string& link_2, bool attached) {
  BodyId a, b;
  if (const Status found = find_body(model_1, link_1, a); !found) return found;
  if (const Status found = find_body(model_2, link_2, b); !found) return found;
  const LinkName first = name_of(a), second = name_of(b);
  if (attached) {
    Status status = attach(a, b);
    if (!status) return status;
    wanted_.push_back({first, second});
    ask_to_attach(first, second);
    return status;
  }
  if (!detach(a, b))
    return Status::refused(fmt::format("'{}' and '{}' are not attached to each other", model_1, model_2));
  ask_to_detach(first, second);
  return {};
}

void AttachmentServices::offer_services() {
  using gazebo_ros_link_attacher::srv::Attach;
  using linkattacher_msgs::srv::AttachLink;
  using linkattacher_msgs::srv::DetachLink;
  for (const bool attached : {true, false}) {
    node_.serve<Attach>(
        attached ? "/attach" : "/detach",
        [this, attached](const Attach::Request& r, const Responder<Attach::Response>& respond) {
          const Status status = join(r.model_name_1, r.link_name_1, r.model_name_2, r.link_name_2, attached);
          if (!status) log_.warning(kAttachOrigin, status.why());
          respond({status.ok()});
        });
  }
  node_.serve<AttachLink>("/ATTACHLINK", [this](const AttachLink::Request& r, const auto& respond) {
    const Status status = join(r.model1_name, r.link1_name, r.model2_name, r.link2_name, true);
    respond({status.ok(), status ? "attached" : status.why()});
  });
  node_.serve<DetachLink>("/DETACHLINK", [this](const DetachLink::Request& r, const auto& respond) {
    const Status status = join(r.model1_name, r.link1_name, r.model2_name, r.link2_name, false);
    respond({status.ok(), status ? "detached" : status.why()});
  });
}

}  // namespace doppel
