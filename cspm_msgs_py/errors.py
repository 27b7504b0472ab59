"""The errors that a user may meet, and the exit code that each one means."""


class CspmError(Exception):
    """Base of all errors that carry one line for the user."""

    exit_code = 1

    @property
    def line(self) -> str:
        """What a program prints: what went wrong, and the remedy where there is one."""
        return str(self)


class InputError(CspmError):
    """Bad usage or bad input: the line says what, where, and what is allowed."""

    exit_code = 2


class DamageError(InputError):
    """A recording is damaged: the line says which file and where.

    Attributes:
        remedy: what restores the rest.
    """

    remedy = "`cspm recover` leaves the damaged part out"

    @property
    def line(self) -> str:
        """As for every error, with the remedy."""
        return f"{self}; {self.remedy}"


class DivergenceError(CspmError):
    """The simulation left the range in which its equations hold."""


class ControllerError(CspmError):
    """A controller of the user's own failed in a run: the line says where in its file."""


class ConvergenceError(CspmError):
    """An iterative solution did not converge or is not unique near the guess."""


class SingularityError(CspmError):
    """A kinematic map was asked for at a pose where it does not exist."""
