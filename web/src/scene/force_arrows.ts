// Arrows of forces with a ball where each acts, in objects that are used again.
import * as THREE from 'three';

interface Mark {
  ball: THREE.Mesh;
  arrow: THREE.ArrowHelper;
}

export class ForceArrows {
  readonly root = new THREE.Group();
  private readonly marks: Mark[] = [];
  private used = 0;

  // `most`: the number of arrows that are drawn.
  constructor(private readonly colour: number, private readonly most: number) {}

  begin(): void {
    this.used = 0;
  }

  // Lengths in metres; an arrow without length is a ball only.
  add(at: THREE.Vector3, direction: THREE.Vector3, length: number, radius: number): void {
    if (this.used >= this.most) return;
    const { ball, arrow } = this.marks[this.used] ?? this.make();
    this.used += 1;
    ball.visible = true;
    ball.position.copy(at);
    ball.scale.setScalar(radius);
    arrow.visible = length > 0 && direction.lengthSq() > 0;
    if (!arrow.visible) return;
    arrow.position.copy(at);
    arrow.setDirection(direction.normalize());
    const head = Math.min(length * 0.3, radius * 8);
    arrow.setLength(length, head, head * 0.5);
  }

  end(): void {
    for (let i = this.used; i < this.marks.length; i += 1) this.marks[i]!.ball.visible = this.marks[i]!.arrow.visible = false;
  }

  private make(): Mark {
    const ball = new THREE.Mesh(new THREE.SphereGeometry(1, 10, 8), new THREE.MeshBasicMaterial({ color: this.colour, depthTest: false, transparent: true }));
    const mark = { ball, arrow: new THREE.ArrowHelper(new THREE.Vector3(0, 0, 1), new THREE.Vector3(), 0.1, this.colour) };
    this.marks.push(mark);
    this.root.add(ball, mark.arrow);
    return mark;
  }
}
