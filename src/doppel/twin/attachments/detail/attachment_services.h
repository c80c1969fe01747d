#pragma once
// Attachments of links of two models to each other (Engine::attach()), on request only: by a service, or by a plugin of
// a description (attachment_plugins.h). On the loop's thread, between steps.
//
// Services: /attach and /detach (gazebo_ros_link_attacher/srv/Attach), /ATTACHLINK and /DETACHLINK
// (linkattacher_msgs). Names of models and links are those of entities (entity.h). They last until they are detached,
// a model is deleted, or a reset.

#include <memory>
#include <string>
#include <vector>

#include "doppel/base/core/log.h"
#include "doppel/description/gazebo/attachment_plugins.h"
#include "doppel/physics/contract/grasp.h"
#include "doppel/ros/bus/bus.h"
#include "doppel/ros/messages/std_msgs.h"
#include "doppel/twin/loop/scene.h"
#include "doppel/twin/loop/tickable.h"

namespace doppel {

class AttachmentServices : public Tickable {
 public:
  // Scene and log outlive it.
  AttachmentServices(Bus& bus, const Scene& scene, const Log& log);
  ~AttachmentServices() override;

  void between_steps(Time now) override;
  void reset(Time now) override;
  void instances_changed() override;
  void save(SavedSlot& slot) override;
  void restore(const SavedPart* saved, Time now) override;

 private:
  // A link by names that outlive a change of instances.
  struct LinkName {
    std::string instance, link;
    bool operator==(const LinkName&) const = default;
  };
  struct Wanted {
    LinkName a, b;
    [[nodiscard]] bool joins(const LinkName& one, const LinkName& other) const {
      return (a == one && b == other) || (a == other && b == one);
    }
  };
  // The behaviour of a plugin of an instance; one class for each kind.
  class Device;
  class Joint;
  class Searcher;
  class Vacuum;
  class Gripper;
  // The devices of an instance, and the model that they were made for.
  struct Equipped {
    std::string instance;
    std::shared_ptr<const Model> model;
    std::vector<std::unique_ptr<Device>> devices;
  };

  struct Saved;

  void offer_services();
  Status join(const std::string& model_1, const std::string& link_1, const std::string& model_2,
              const std::string& link_2, bool attached);
  [[nodiscard]] Status find_body(const std::string& model, const std::string& link, BodyId& body) const;
  [[nodiscard]] LinkName name_of(BodyId body) const;
  [[nodiscard]] bool find(const LinkName& name, BodyId& body) const;
  [[nodiscard]] bool are_attached(BodyId a, BodyId b) const;
  Status attach(BodyId a, BodyId b);
  bool detach(BodyId a, BodyId b);
  // A client's request outlives the plugin's device, which a reload makes again.
  void ask_to_detach(const LinkName& a, const LinkName& b);
  void ask_to_attach(const LinkName& a, const LinkName& b);
  [[nodiscard]] bool is_to_be_detached(const LinkName& a, const LinkName& b) const;
  void equip(const ModelInstance& instance, Equipped& out);

  const Scene& scene_;
  const Log& log_;
  Node node_;
  std::vector<Wanted> wanted_;    // by services
  std::vector<Wanted> detached_;  // by services and topics, until they are attached on request
  std::vector<Equipped> equipped_;
  std::string last_refusal_;
};

}  // namespace doppel
