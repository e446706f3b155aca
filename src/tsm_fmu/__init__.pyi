from .card import ModelCard as ModelCard
from .card import read_card as read_card
from .card import write_card as write_card
from .diagnosis.result import Diagnosis as Diagnosis
from .kernels.chain import chain as chain
from .kernels.kernel import Kernel as Kernel
from .kernels.kernel import kernel as kernel
from .logs.record import Record as Record
from .logs.record import read_record as read_record
from .logs.record import write_record as write_record
from .models.contract import InputError as InputError
from .verbs.check import CheckResult as CheckResult
from .verbs.check import check as check
from .verbs.diagnose import diagnose as diagnose
from .verbs.export import export as export
from .verbs.identify import IdentifyResult as IdentifyResult
from .verbs.identify import identify as identify
from .verbs.run import RunResult as RunResult
from .verbs.run import run as run
from .verbs.samples import sample as sample
from .verbs.simulate import SimulateResult as SimulateResult
from .verbs.simulate import simulate as simulate
from .verbs.sweep import SweepResult as SweepResult
from .verbs.sweep import sweep as sweep

__version__: str
