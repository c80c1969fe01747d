// doppel spawn and delete: adds and removes robots of a running twin.
#include "app/verbs/description_target.h"
#include "app/verbs/shell.h"
#include "app/verbs/verbs.h"
#include "doppel/messages/gazebo_msgs.h"
#include "doppel/sensing/pose_messages.h"
#include "doppel/target/target.h"
#include "doppel/twin/robot_text.h"

namespace doppel::app {
namespace {

constexpr std::chrono::seconds kSpawnTimeout{60};  // a robot with large meshes loads slowly

struct SpawnOptions {
  std::vector<std::string> words;  // TARGET and its name:=value
  std::string name_space, place = "0,0,0";
};

struct DeleteOptions {
  std::string name;
};

template <Service S>
int call_and_print(Client& twin, const std::string& service, const typename S::Request& request) {
  const auto answer = decode<typename S::Response>(call_raw(twin, service, to_cdr(request), kSpawnTimeout));
  if (!answer.success) throw ClientError(answer.status_message);
  print_line("{}\n", answer.status_message);
  return 0;
}

int spawn(Shell& shell, const SpawnOptions& options) {
  const geometry_msgs::msg::Pose place = to_pose_msg(parse_place(options.place, "--at"));
  DescriptionTarget target = open_target(options.words);
  Diagnostics chosen;
  target.arguments =
      simulation_arguments(target.target.description, std::move(target.arguments), target.resolver, chosen);
  print_diagnostics(chosen, true);
  const LoadedDescription loaded = load_target(target);
  using gazebo_msgs::srv::SpawnEntity;
  SpawnEntity::Request request;
  request.name = options.name_space.empty() ? loaded.robot.name : options.name_space;
  request.robot_namespace = request.name;
  request.xml = loaded.robot.xml;
  request.initial_pose = place;
  return call_and_print<SpawnEntity>(shell.twin(), "/spawn_entity", request);
}

int delete_entity(Shell& shell, const DeleteOptions& options) {
  using gazebo_msgs::srv::DeleteEntity;
  DeleteEntity::Request request;
  request.name = options.name;
  return call_and_print<DeleteEntity>(shell.twin(), "/delete_entity", request);
}

}  // namespace

void add_spawn(CLI::App& app, int& exit_code) {
  add_verb<SpawnOptions>(
      app, "spawn", "Spawn a robot with its controllers in a running twin",
      "doppel spawn omarm_one --ns right --at 0.8,0,0,0,0,3.14159", exit_code,
      [](CLI::App& verb, SpawnOptions& options) {
        add_target(verb, options.words);
        verb.add_option("--ns", options.name_space,
                        "Namespace, also its name in the world (default: the name in the description)");
        verb.add_option("--at", options.place, "Pose of its root link: x,y,z[,roll,pitch,yaw], m and rad")
            ->capture_default_str();
      },
      spawn);
  add_verb<DeleteOptions>(
      app, "delete", "Delete a robot or an object from a running twin", "doppel delete right", exit_code,
      [](CLI::App& verb, DeleteOptions& options) {
        verb.add_option("name", options.name, "Namespace of the robot, or name of the object")->required();
      },
      delete_entity);
}

}  // namespace doppel::app
