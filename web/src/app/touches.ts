// Contacts of a sensor, in either of its messages: ros_gz_interfaces/Contacts and gazebo_msgs/ContactsState.
import type { Message, Value } from '../protocol/cdr';

// Between two collisions.
export interface Touch {
  own: string;
  other: string;
  points: Value[]; // m, in the frame of the header
  forces: Value[]; // N, on the own collision
}

export function readTouches(message: Message): Touch[] {
  const list = (value: Value | undefined): Message[] => (value ?? []) as Message[];
  if (message['states'] !== undefined) {
    return list(message['states']).map((state) => ({
      own: String(state['collision1_name']),
      other: String(state['collision2_name']),
      points: list(state['contact_positions']),
      forces: list(state['wrenches']).map((wrench) => wrench['force']!),
    }));
  }
  const name = (entity: Value | undefined): string => String((entity as Message | undefined)?.['name'] ?? '');
  return list(message['contacts']).map((contact) => ({
    own: name(contact['collision1']),
    other: name(contact['collision2']),
    points: list(contact['positions']),
    forces: list(contact['wrenches']).map((wrench) => (wrench['body_1_wrench'] as Message)['force']!),
  }));
}

// N, of all points together.
export function forceOf({ forces }: Touch): number {
  const sum = [0, 0, 0];
  for (const force of forces as unknown as { x: number; y: number; z: number }[]) {
    sum[0]! += force.x;
    sum[1]! += force.y;
    sum[2]! += force.z;
  }
  return Math.hypot(...sum);
}
