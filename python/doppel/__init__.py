"""doppel: a robot's description as a model and as a digital twin.

    import doppel
    with doppel.Twin("omarm_one") as twin:
        twin.run_for(1.0)
        print(twin.joint("Revolute 2").q)

`doppel man python.md` describes the package.
"""
from . import _doppel
from ._client import Client, ClientController, ClientSubscription
from ._errors import IkError, InputError, ServiceError
from ._model import Joint, Link, Model, pose, quat_wxyz, quat_xyzw
from ._rollout import rollout
from ._twin import Camera, Controller, Goal, Page, Recording, Subscription, Twin, TwinJoint, TwinRobot

__version__ = _doppel.version
__all__ = ["Camera", "Client", "ClientController", "ClientSubscription", "Controller", "Goal", "IkError", "InputError", "Joint",
           "Link", "Model", "Page", "Recording", "ServiceError", "Subscription", "Twin", "TwinJoint", "TwinRobot", "pose", "quat_wxyz", "quat_xyzw", "rollout"]
