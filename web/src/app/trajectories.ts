// Waypoints as YAML for each controller: one document for each controller that commands one of the joints.
import type { Commander, Waypoint } from './commander';
import { trajectoryYaml } from './pose_yaml';
import type { Twin } from './twin';

export function waypointsYaml(twin: Twin, commander: Commander, waypoints: Waypoint[]): string {
  const joints = (twin.tree?.moving ?? []).filter((joint) => !joint.mimic);
  const owners = new Map<string, typeof joints>();
  for (const joint of joints) {
    const owner = commander.owner(joint);
    const name = owner && /trajectory/i.test(owner.type) ? owner.name : '';
    owners.set(name, [...(owners.get(name) ?? []), joint]);
  }
  return [...owners].map(([owner, theirs]) => trajectoryYaml(theirs.map((joint) => joint.name),
    waypoints.map(({ time, positions }) => ({ time, positions: theirs.map((joint) => positions[joint.index]!) })),
    owner ? twin.own(`/${owner}/joint_trajectory`) : '')).join('---\n');
}
