// Requests to the simulation: pause, step, speed, reset.
import type { Message } from '../protocol/cdr';
import type { App } from './app';
import { toast } from './dom';
import type { Twin } from './twin';

// A refusal is shown.
export function callSimulation(twin: Twin, service: string, request: Message = {}, then: (answer: Message) => void = () => {}): void {
  twin.client.call(service, request).then(
    (answer) => {
      if (answer['success'] === false) toast(String(answer['message']), 'warning');
      else then(answer);
    },
    (problem: Error) => toast(problem.message, 'error'),
  );
}

export function resetSimulation({ hardware, twin, world }: App): void {
  hardware.confirm('Reset', 'Time and joints go back to the start.', () => {
    world.trace.clear();
    callSimulation(twin, '/gazebo/reset_simulation');
  });
}
