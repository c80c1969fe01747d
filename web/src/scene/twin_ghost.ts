// The twin beside real hardware, translucent: the picture's robot is where the measured joints are.
import * as THREE from 'three';
import type { App } from '../app/app';
import type { Devices } from '../app/devices';
import type { ToolDriver } from '../app/tool';
import { RobotView } from '../robot/view';
import type { TreeJoint } from '../robot/tree';
import { cssColour, type Legend } from './legend';

const PLAIN = 0x0072b2, ALARM = 0xd55e00;
const ENTRY = 'twin';

export class TwinGhost {
  view: RobotView | null = null;
  readonly material = new THREE.MeshBasicMaterial({ color: PLAIN, transparent: true, opacity: 0.35, depthWrite: false });

  constructor(private readonly app: App, private readonly driver: ToolDriver, private readonly devices: Devices, private readonly legend: Legend) {
    app.twin.robotChanged.on(() => {
      this.view?.root.removeFromParent();
      this.view = null;
    });
    devices.mirrored.on(() => this.draw());
    setInterval(() => devices.lookForEnd(), 1000);
  }

  // Only a twin that gets the commands is elsewhere than the measured joints.
  private draw(): void {
    const { twin, world } = this.app;
    const { mirror } = this.devices;
    const joints: [TreeJoint, number][] = [];
    for (const one of mirror?.joints ?? []) {
      const joint = twin.tree?.jointByName.get(one.name);
      if (joint) joints.push([joint, one.twin]);
    }
    const poses = mirror?.mode === 'shadow' || mirror?.mode === 'rehearse' ? this.driver.posesAt(joints) : null;
    if (!twin.tree || !poses) {
      this.hide();
      return;
    }
    if (!this.view) {
      this.view = new RobotView(twin.tree, world.meshes, world.stage.invalidate, this.material);
      this.view.show('visual', true);
      world.stage.scene.add(this.view.root);
    }
    const alarm = this.devices.alarms[0];
    this.material.color.set(alarm ? ALARM : PLAIN);
    this.view.place(poses);
    this.view.root.visible = true;
    this.legend.show(ENTRY, { key: 'line', colour: cssColour(alarm ? ALARM : PLAIN), label: 'twin', value: alarm ? `${alarm.name}: ${alarm.alarm.split(':')[0]}` : '' });
    world.stage.invalidate();
  }

  private hide(): void {
    if (!this.view?.root.visible) return;
    this.view.root.visible = false;
    this.legend.show(ENTRY, null);
    this.app.world.stage.invalidate();
  }
}
