"""Annotations: an editor knows the type of everything that a program can name."""
import inspect
import unittest

import doppel
import doppel.envs


def public_functions():
    """Names and functions: those of the package, and the methods and properties of its classes that begin with no underline, with
    the constructors and what `with` calls."""
    for module in (doppel, doppel.envs):
        for name in module.__all__:
            value = getattr(module, name)
            if not inspect.isclass(value):
                yield name, value
                continue
            for member, function in vars(value).items():
                if member.startswith("_") and member not in ("__init__", "__enter__", "__exit__", "__getitem__"):
                    continue
                function = function.fget if isinstance(function, property) else getattr(function, "__func__", function)
                if inspect.isfunction(function):
                    yield f"{name}.{member}", function


class TypingTest(unittest.TestCase):
    def test_EveryPublicFunctionIsAnnotated(self):
        names = set()
        for name, function in public_functions():
            names.add(name)
            signature = inspect.signature(function)
            untyped = [one for one, parameter in signature.parameters.items()
                       if parameter.annotation is inspect.Parameter.empty and one not in ("self", "cls")]
            self.assertEqual(untyped, [], name)
            if not name.endswith("__init__"):
                self.assertIsNot(signature.return_annotation, inspect.Signature.empty, name)
        self.assertLessEqual({"Twin.__enter__", "Twin.step", "TwinJoint.q", "Model.load", "rollout"}, names)

    def test_EveryPublicFunctionHasDocstring(self):
        missing = [name for name, function in public_functions() if "__" not in name and not function.__doc__]
        self.assertEqual(missing, [])


if __name__ == "__main__":
    unittest.main()
