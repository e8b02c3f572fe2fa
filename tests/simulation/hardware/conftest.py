import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))  # fake_board, also for processes that are started from here
