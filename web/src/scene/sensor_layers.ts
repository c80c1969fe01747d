// The layers of the picture that show what sensors see and measure.
import type { App } from '../app/app';
import type { LayerChoice } from '../app/layer_toggles';
import type { Sensor, Sensors } from '../app/sensors';
import { CameraViews } from './camera_views';
import { FramePoses } from './frame_poses';
import type { Legend } from './legend';
import { SensorForces } from './sensor_forces';
import { SensorPoints } from './sensor_points';

export class SensorLayers {
  readonly cameras: CameraViews;
  readonly lidar: SensorPoints;
  readonly clouds: SensorPoints;
  readonly forces: SensorForces;

  constructor(app: App, private readonly sensors: Sensors, legend: Legend) {
    const frames = new FramePoses(app.twin, app.world.others);
    this.cameras = new CameraViews(app, sensors, frames);
    this.lidar = new SensorPoints(app, sensors, frames, legend, 'lidar');
    this.clouds = new SensorPoints(app, sensors, frames, legend, 'clouds');
    this.forces = new SensorForces(app, sensors, frames, legend);
  }

  // Those for which there is a sensor.
  offered(): LayerChoice[] {
    const layers: [LayerChoice, (sensor: Sensor) => boolean][] = [
      [{ id: 'cameras', label: 'Camera views', title: 'The volume that each camera sees, by its camera_info' }, (one) => this.sensors.topicsOf(one, 'sensor_msgs/CameraInfo').length > 0],
      [{ id: 'lidar', label: 'Lidar points', title: 'Points that lidars measure' }, (one) => this.lidar.has(one)],
      [{ id: 'clouds', label: 'Depth points', title: 'Points that depth cameras measure' }, (one) => this.clouds.has(one)],
      [{ id: 'touches', label: 'Contact sensors', title: 'Forces on the links of contact sensors' }, (one) => this.forces.has(one, 'touches')],
      [{ id: 'wrenches', label: 'Force and torque', title: 'What force-torque sensors measure' }, (one) => this.forces.has(one, 'wrenches')],
    ];
    return layers.filter(([, has]) => this.sensors.list.some(has)).map(([layer]) => layer);
  }
}
