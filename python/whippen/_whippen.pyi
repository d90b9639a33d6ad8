from typing import Any, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

__version__: str

class ProgramError(Exception): ...

class Program:
    def __init__(
        self,
        sources: Sequence[tuple[str, str]],
        instrument: str | None = ...,
        device: str | None = ...,
        tick_rate: float | None = ...,
        set: Mapping[str, float | str | bool] | None = ...,
    ) -> None: ...
    @property
    def instruments(self) -> list[str]: ...
    def run(
        self,
        motion: NDArray[np.float64] | Mapping[str, NDArray[np.float64]] | str | None = ...,
        *,
        set: Mapping[str, float | str | bool] | None = ...,
        engine: str = ...,
        motion_rate_hz: float | None = ...,
        seconds: float | None = ...,
        columns: Sequence[str] | None = ...,
    ) -> Run: ...

class Run:
    @property
    def instrument(self) -> str: ...
    @property
    def engine(self) -> str: ...
    @property
    def rate_hz(self) -> float: ...
    @property
    def start_s(self) -> float: ...
    @property
    def ticks(self) -> int: ...
    @property
    def columns(self) -> dict[str, NDArray[np.float64]]: ...
    @property
    def labels(self) -> dict[str, list[str]]: ...
    @property
    def events(self) -> list[dict[str, Any]]: ...
    @property
    def counts(self) -> dict[str, int]: ...
    def svg(self) -> str: ...

def command(words: Sequence[str]) -> int: ...
