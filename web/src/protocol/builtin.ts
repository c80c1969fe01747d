// Types that the page publishes even if the twin does not advertise them.

const TIME = '================================================================================\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n';
const DURATION = '================================================================================\nMSG: builtin_interfaces/Duration\nint32 sec\nuint32 nanosec\n';
const VECTOR = '================================================================================\nMSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n';
const HEADER = '================================================================================\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n';

export const BUILTIN: Record<string, string> = {
  'trajectory_msgs/msg/JointTrajectory':
    'std_msgs/Header header\nstring[] joint_names\ntrajectory_msgs/JointTrajectoryPoint[] points\n' + HEADER + TIME +
    '================================================================================\nMSG: trajectory_msgs/JointTrajectoryPoint\n' +
    'float64[] positions\nfloat64[] velocities\nfloat64[] accelerations\nfloat64[] effort\nbuiltin_interfaces/Duration time_from_start\n' +
    DURATION,
  'geometry_msgs/msg/Twist': 'geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular\n' + VECTOR,
  'geometry_msgs/msg/TwistStamped':
    'std_msgs/Header header\ngeometry_msgs/Twist twist\n' + HEADER + TIME +
    '================================================================================\nMSG: geometry_msgs/Twist\n' +
    'geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular\n' + VECTOR,
  'std_msgs/msg/Float64MultiArray':
    'std_msgs/MultiArrayLayout layout\nfloat64[] data\n' +
    '================================================================================\nMSG: std_msgs/MultiArrayLayout\n' +
    'std_msgs/MultiArrayDimension[] dim\nuint32 data_offset\n' +
    '================================================================================\nMSG: std_msgs/MultiArrayDimension\n' +
    'string label\nuint32 size\nuint32 stride\n',
  'sensor_msgs/msg/JointState':
    'std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n' + HEADER + TIME,
};
